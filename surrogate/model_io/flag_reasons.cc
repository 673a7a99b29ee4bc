#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "surrogate/model_io/state_facts.h"

namespace grouser::surrogate {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr double kMostAngle = std::numbers::pi;

/// Reasons of one flag, as they are found.
class Reasons {
 public:
  Reasons(Flag flag, v1alpha1::Explanation* to) : flag_(flag), to_(to) {}

  void Say(const std::string& text) { Say(text, "", kNoNumber, kNoNumber); }
  void Say(const std::string& text, const char* quantity, double value, double limit) {
    said_ = true;
    v1alpha1::FlagReason* reason = to_->add_reasons();
    reason->set_flag(static_cast<v1alpha1::StateFlag>(flag_));
    reason->set_text(text);
    reason->set_quantity(quantity);
    reason->set_value(value);
    reason->set_limit(limit);
  }
  bool said() const { return said_; }

 private:
  Flag flag_;
  v1alpha1::Explanation* to_;
  bool said_ = false;
};

std::string Degrees(double rad) { return fmt::format("{:.4g} deg", rad * kDegPerRad); }

void InvalidSlip(const v1alpha1::Explanation& e, Reasons* say) {
  const double slip = e.slip(), angle = e.attack_angle_rad(), speed = e.speed_m_per_s();
  if (!std::isfinite(slip)) return say->Say(fmt::format("slip {}, expected a finite number", slip));
  if (!(std::fabs(angle) <= kMostAngle + 1e-9)) {
    return say->Say("attack angle " + Degrees(angle) + ", expected -180 to 180 deg",
                    "attack_angle_rad", angle, kMostAngle);
  }
  if (!(speed >= 0) || !std::isfinite(speed)) {
    return say->Say(fmt::format("speed {:.4g} m/s, expected a finite one, 0 or more", speed));
  }
  const SlipRange range = SlipsAt(angle);
  say->Say(
      fmt::format("slip {:.4g} at attack angle {}, which no motion has: {:.4g} to {:.4g} there",
                  slip, Degrees(angle), range.low, range.high),
      "slip", slip, slip < range.low ? range.low : range.high);
}

void Invalid(const StateFacts& f, const v1alpha1::Explanation& e, Reasons* say) {
  const VelocityState& v = f.motion;
  const bool finite = std::isfinite(v.rim_speed) && std::isfinite(std::hypot(v.v_x, v.v_y));
  if (!finite && f.by_slip) InvalidSlip(e, say);
  if (!finite && !f.by_slip) {
    say->Say(fmt::format("v_x {:.4g}, v_y {:.4g}, rim speed {:.4g} m/s, expected finite numbers",
                         v.v_x, v.v_y, v.rim_speed));
  }
  if (!(f.load >= 0) || !std::isfinite(f.load)) {
    say->Say(fmt::format("load {:.4g} N, expected a finite one, 0 or more", f.load), "load_n",
             f.load, 0);
  }
  const auto angle = [&](const char* name, double x) {
    if (!std::isfinite(x)) say->Say(fmt::format("{} {}, expected a finite number", name, x));
  };
  angle("ground slope along x [rad]", f.pitch);
  angle("ground slope along y [rad]", f.roll);
  angle("yaw rate [rad/s]", f.yaw);
}

void Faces(const StateFacts& f, Reasons* say) {
  const TrainingDomain& box = f.hull->box();
  const Canonical& s = *f.canonical;
  const double slip = s.rim - s.forward, angle = std::atan2(s.lateral, s.forward);
  const std::uint32_t beyond = FacesBeyond(box, s, f.load);
  if ((beyond & (kBelowSlip | kAboveSlip)) != 0) {
    const bool below = (beyond & kBelowSlip) != 0;
    const double limit = below ? box.slip_min : box.slip_max;
    say->Say(
        fmt::format("slip {:.4g} is {} the training runs' {:.4g} to {:.4g}, by {:.2g}", slip,
                    below ? "below" : "above", box.slip_min, box.slip_max, std::fabs(slip - limit)),
        "slip", slip, limit);
  }
  if ((beyond & kOtherSheet) != 0) {
    say->Say(
        "the rim turns against the travel and is faster than the hub: no run is made there (it "
        "shares its slip with a state where the hub is the faster)");
  }
  if ((beyond & kAboveAngle) != 0) {
    say->Say(
        fmt::format("attack angle {} is above the training runs' {}, by {}", Degrees(angle),
                    Degrees(box.attack_angle_max_rad), Degrees(angle - box.attack_angle_max_rad)),
        "attack_angle_rad", angle, box.attack_angle_max_rad);
  }
  if ((beyond & (kBelowLoad | kAboveLoad)) != 0) {
    const bool below = (beyond & kBelowLoad) != 0;
    const double limit = below ? box.load_min_n : box.load_max_n;
    say->Say(fmt::format("load {:.4g} N is {} the training runs' {:.4g} to {:.4g} N, {:.3g} times "
                         "the {}",
                         f.load, below ? "below" : "above", box.load_min_n, box.load_max_n,
                         f.load / limit, below ? "least" : "largest"),
             "load_n", f.load, limit);
  }
}

void Extrapolated(const StateFacts& f, Reasons* say) {
  if ((f.flags & kStatic) != 0) say->Say("a wheel at rest: no run is made of one");
  if (!f.hull) return;
  if (f.canonical) {
    Faces(f, say);
    if (f.distance > Hull::kFarFromRuns) {
      say->Say(fmt::format("hull distance {:.2f}: far from every training run, above {:.2g} (0 at "
                           "runs, 1 far away{})",
                           f.distance, Hull::kFarFromRuns,
                           f.distance > f.table_distance ? "; grown beyond the domain" : ""),
               "hull_distance", f.distance, Hull::kFarFromRuns);
    }
  }
  const double most = Hull::kOverloadSinkage * f.model->wheel().radius_m();
  if (f.value[kSinkage] > most) {
    say->Say(fmt::format("sinkage {:.1f} mm is above {:.2g} of the radius, {:.1f} mm: runs end "
                         "there, as overloads",
                         1e3 * f.value[kSinkage], Hull::kOverloadSinkage, 1e3 * most),
             "sinkage_m", f.value[kSinkage], most);
  }
}

// To what a text shows of the share.
bool PhysicsAlone(const StateFacts& f) { return f.share < 0.005; }

std::string PhysicsPart(const StateFacts& f) {
  return fmt::format("{:.0f} % of the answer is theirs", 100 * (1 - f.share));
}

void NoEquilibrium(const StateFacts& f, Reasons* say) {
  const std::string carries =
      fmt::format("the soil carries {:.4g} of {:.4g} N", f.value[kFz], f.load);
  say->Say(PhysicsAlone(f) ? carries + " at a sinkage of 1.2 radii, where the model ends"
                           : carries + ": the law of the physics does not carry the load, and " +
                                 PhysicsPart(f),
           "f_z_n", f.value[kFz], f.load);
}

void Clamped(const StateFacts& f, Reasons* say) {
  if (f.yaw != 0 && !f.evaluator->UsesYawRate()) {
    say->Say(
        fmt::format("a yaw rate of {:.3g} rad/s was given; the model has none and takes 0", f.yaw),
        "yaw_rate_rad_per_s", f.yaw, 0);
  }
  if ((f.flags & kNoEquilibrium) != 0 && !PhysicsAlone(f)) {
    say->Say("the physics' sinkage was held at 1.2 radii, and " + PhysicsPart(f));
  } else if ((f.flags & kNoEquilibrium) != 0) {
    say->Say(fmt::format("the sinkage was held at 1.2 radii, {:.1f} mm",
                         1.2e3 * f.model->wheel().radius_m()),
             "sinkage_m", f.value[kSinkage], 1.2 * f.model->wheel().radius_m());
  }
  if (f.value[kSinkage] == 0) {
    say->Say("the sinkage came out below 0, and 0 is answered", "sinkage_m", 0, 0);
  }
}

void Rate(const StateFacts& f, Reasons* say) {
  if (!f.canonical || !f.hull) return;
  const double radius = f.model->wheel().radius_m(), most = f.hull->Fastest(radius);
  say->Say(
      fmt::format("{:.4g} m/s (Froude number {:.3g}) is above {:.4g} m/s ({:.3g}), to which the "
                  "runs' forces hold",
                  f.canonical->speed, f.hull->Froude(f.canonical->speed, radius), most,
                  f.hull->box().froude_max),
      "speed_m_per_s", f.canonical->speed, most);
}

void Slope(const StateFacts& f, Reasons* say) {
  const auto one = [&](const char* axis, const char* quantity, double x) {
    if (x == 0) return;
    say->Say(fmt::format("a ground slope of {} along {} was given; the model's runs were on level "
                         "ground, so nothing is answered",
                         Degrees(x), axis),
             quantity, x, 0);
  };
  one("x", "slope_pitch_rad", f.pitch);
  one("y", "slope_roll_rad", f.roll);
}

void VirginAssumed(const StateFacts& f, Reasons* say) {
  say->Say(fmt::format("pass {} was given; the model's runs were on virgin ground, so nothing is "
                       "answered",
                       f.pass),
           "pass_number", f.pass, 1);
}

void FormUnknown(const StateFacts& f, Reasons* say) {
  if (f.model->form_by_region().empty()) {
    return say->Say(
        f.model->sd_form().empty()
            ? "this model was never compared with measurements (grouser model compare --out)"
            : "this model's sd_form is of all measured rows, without a factor by region");
  }
  if (!f.region)
    return say->Say("no measurement is of a wheel at rest, or of what is not answered");
  const auto at = static_cast<std::size_t>(*f.region);
  std::string lacking;
  for (const Output o : kPredicted) {
    if (!std::isnan(f.form.region[at].sd[o] * f.form.region[at].factor[o])) continue;
    lacking += (lacking.empty() ? "" : ", ") + std::string(kOutputFields[o].name);
  }
  say->Say("DEM was not compared with a measurement of " + lacking + " in the region \"" +
           kMeasuredRegionNames[at] + "\"");
}

void Untuned(const StateFacts& f, Reasons* say) {
  say->Say("nothing was fitted to this wheel on this soil: parameters of " +
           (f.model->kind() == v1alpha1::MODEL_KIND_HARD ? std::string("hard ground")
                                                         : std::string("a table of soils")));
}

/// Of a flag whose condition is not met to the last bit: kernels and laws round in their own ways.
const char* Meaning(Flag flag) {
  switch (flag) {
    case kInvalid:
      return "a number that is not finite, or that no wheel state has";
    case kClamped:
      return "an answer was held at an end of what the model can say";
    case kExtrapolated:
      return "at the border of what the training runs cover";
    case kRate:
      return "at the largest speed to which the runs' forces hold";
    default:
      return "set by the model's law";
  }
}

void Collect(Flag flag, const StateFacts& f, const v1alpha1::Explanation& e, Reasons* say) {
  switch (flag) {
    case kInvalid:
      return Invalid(f, e, say);
    case kClamped:
      return Clamped(f, say);
    case kExtrapolated:
      return Extrapolated(f, say);
    case kStatic:
      return say->Say("hub and rim stand still: forces but f_z are 0");
    case kNoEquilibrium:
      return NoEquilibrium(f, say);
    case kRate:
      return Rate(f, say);
    case kSlope:
      return Slope(f, say);
    case kVirginAssumed:
      return VirginAssumed(f, say);
    case kFormUnknown:
      return FormUnknown(f, say);
    case kToleranceUnmet:
      return;  // of model selectors, which are not explained
    case kAirborne:
      return say->Say("load 0: a wheel off the ground, every output is exactly 0", "load_n", 0, 0);
    case kUntuned:
      return Untuned(f, say);
  }
}

}  // namespace

void AddReasons(const StateFacts& facts, v1alpha1::Explanation* explanation) {
  for (const FlagField& field : kFlagFields) {
    if ((facts.flags & field.flag) == 0) continue;
    Reasons reasons(field.flag, explanation);
    Collect(field.flag, facts, *explanation, &reasons);
    if (!reasons.said()) reasons.Say(Meaning(field.flag));
  }
}

}  // namespace grouser::surrogate
