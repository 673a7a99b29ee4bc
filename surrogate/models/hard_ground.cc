#include "surrogate/models/hard_ground.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace grouser::surrogate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using G = HardGround;
constexpr HardGroundField kFields[] = {
    {"friction", &G::friction, false, true, "Coulomb's mu"},
    {"slip_stiffness", &G::slip_stiffness, false, true, "force over load and slip at slip 0"},
    {"rolling_resistance", &G::rolling_resistance, true, true, "force over load"},
    {"contact_length_m", &G::contact_length_m, false, true,
     "of the contact patch, along the wheel"},
    {"contact_width_m", &G::contact_width_m, false, true, "across"},
    {"friction_sd", &G::friction_sd, true, false, "standard deviation of mu (0)"},
    {"slip_stiffness_sd", &G::slip_stiffness_sd, true, false, "(0)"},
    {"rolling_resistance_sd", &G::rolling_resistance_sd, true, false, "(0)"},
};

constexpr double kRollingBand = 0.02;  // |r w| over max(|r w|, V) below which sgn is smoothed

void Check(const char* field, double value, bool zero_allowed) {
  if (std::isfinite(value) && (value > 0 || (zero_allowed && value == 0))) return;
  throw std::invalid_argument(std::string("hard: ") + field + ": got " + std::to_string(value) +
                              ", expected a finite number " +
                              (zero_allowed ? "from 0 on" : "above 0"));
}

// Mean distance of the points of a rectangle with half sides a and b from its middle.
double MeanRadius(double a, double b) {
  const double d = std::hypot(a, b);
  return (d + b * b / (2 * a) * std::log((a + d) / b) + a * a / (2 * b) * std::log((b + d) / a)) /
         3;
}

void Put(std::span<double> to, std::size_t i, double value) {
  if (!to.empty()) to[i] = value;
}

// A value and its derivatives by v_x, v_y and rim speed.
struct Term {
  double value = 0, d_x = 0, d_y = 0, d_rim = 0;
};

void Write(const OutputView& to, std::size_t i, const Term& t, double by_load, double sd) {
  Put(to.value, i, t.value + 0.0);  // never -0
  Put(to.sd_fit, i, sd);
  Put(to.sd_patch, i, 0);
  Put(to.low, i, t.value - kTwoSided90 * sd);
  Put(to.high, i, t.value + kTwoSided90 * sd);
  Put(to.d_v_x, i, t.d_x);
  Put(to.d_v_y, i, t.d_y);
  Put(to.d_rim_speed, i, t.d_rim);
  Put(to.d_load, i, by_load);
}

// How much of the friction is mobilised, over S, and how that changes.
struct Mobilised {
  double over_slide;        // g/S
  double by_slide, by_rim;  // its derivatives by S and by |r w|
  double by_friction;       // d(mu g)/d mu, over S
  double by_stiffness;      // C dg/dC, over S
  double rest;              // 1 - x, 0 where all slides
};
Mobilised Mobilise(double k, double slide, double rolling) {
  if (k * slide >= rolling) {
    if (slide == 0) return {0, 0, 0, 0, 0, 0};
    return {1 / slide, -1 / (slide * slide), 0, 1 / slide, 0, 0};
  }
  const double per = k / rolling, x = per * slide;
  const double h = per * (3 - 3 * x + x * x), steep = per * (2 * x - 3);
  const double rest = 1 - x;
  return {
      h,   steep * per, -(h + steep * x) / rolling, per * x * (3 - 2 * x), 3 * per * rest * rest,
      rest};
}

}  // namespace

std::span<const HardGroundField> HardGroundFields() noexcept { return kFields; }

HardGroundModel::HardGroundModel(const HardGround& ground, double radius_m, std::uint32_t flags)
    : ground_(ground), radius_m_(radius_m), flags_(flags) {
  for (const HardGroundField& f : kFields) Check(f.name, ground.*f.member, f.zero_allowed);
  Check("radius_m", radius_m, false);
  scrub_radius_m_ = MeanRadius(ground.contact_length_m / 2, ground.contact_width_m / 2);
}

void HardGroundModel::Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept {
  for (std::size_t i = 0; i < in.load.size(); ++i) EvaluateOne(in, out, i);
}

void HardGroundModel::EvaluateOne(const WheelStatesView& in, const ResponsesView& out,
                                  std::size_t i) const noexcept {
  const double v_x = in.v_x[i], v_y = in.v_y[i], rim = in.rim_speed[i], load = in.load[i];
  const double yaw = in.yaw_rate.empty() ? 0 : in.yaw_rate[i];
  const double hub2 = v_x * v_x + v_y * v_y, rolling = std::fabs(rim);
  if (!out.slip.empty() || !out.attack_angle.empty()) {
    const SlipState echo = ToSlip(v_x, v_y, rim);
    Put(out.slip, i, echo.slip);
    Put(out.attack_angle, i, echo.attack_angle_rad);
  }
  if (!std::isfinite(hub2) || !std::isfinite(rim) || !std::isfinite(yaw) || !(load >= 0) ||
      !std::isfinite(load)) {
    out.flags[i] = kInvalid;
    for (const OutputView& o : out.output) {
      for (const auto part : kPartMembers) Put(o.*part, i, kNaN);
    }
    return;
  }
  if (load == 0) {
    WriteAirborne(out, i);
    return;
  }
  out.flags[i] = flags_ | (hub2 == 0 && rim == 0 && yaw == 0 ? kStatic : 0u);

  const double mu = ground_.friction, rho = scrub_radius_m_, r = radius_m_;
  const double s_x = v_x - rim, s_y = v_y, s_z = rho * yaw;
  const double slide = std::sqrt(s_x * s_x + s_y * s_y + s_z * s_z);
  const double k = ground_.slip_stiffness / (3 * mu), sense = rim < 0 ? -1 : 1;
  const Mobilised m = Mobilise(k, slide, rolling);
  // dg/d(v_x, v_y, rim): by S along s/S, by |r w| besides.
  const double per = slide > 0 ? m.by_slide / slide : 0;
  const Term g{m.over_slide, per * s_x, per * s_y, -per * s_x + m.by_rim * sense};
  const double grip = mu * load;
  const Term f_x{-grip * g.value * s_x, -grip * (g.value + s_x * g.d_x), -grip * s_x * g.d_y,
                 grip * (g.value - s_x * g.d_rim)};
  const Term f_y{-grip * g.value * s_y, -grip * s_y * g.d_x, -grip * (g.value + s_y * g.d_y),
                 -grip * s_y * g.d_rim};

  Term m_z{-grip * rho * g.value * s_z, -grip * rho * s_z * g.d_x, -grip * rho * s_z * g.d_y,
           -grip * rho * s_z * g.d_rim};
  if (m.rest > 0) {  // aligning; 1 - x = 1 - k S/|r w|
    const double scale = grip * ground_.contact_length_m / 2 * k / rim, rest2 = m.rest * m.rest;
    const double lever = scale * rest2 * m.rest, steep = -3 * scale * rest2 * s_y * k / rolling;
    const double along = slide > 0 ? steep / slide : 0;
    m_z.value += lever * s_y;
    m_z.d_x += along * s_x;
    m_z.d_y += along * s_y + lever;
    m_z.d_rim += -along * s_x - steep * slide / rim - lever * s_y / rim;
  }

  // Rolling resistance, with sgn(r w) smoothed as u (3 - u^2)/2, u = r w/(band V).
  const double resist = ground_.rolling_resistance * load * r;
  const double band = kRollingBand * std::sqrt(hub2);
  Term sign{rim == 0 ? 0.0 : sense, 0, 0, 0};
  if (rolling < band) {
    const double u = rim / band, steep = 1.5 * (1 - u * u);
    sign = {u * (3 - u * u) / 2, -steep * u * v_x / hub2, -steep * u * v_y / hub2, steep / band};
  }
  const Term torque{r * f_x.value + resist * sign.value, r * f_x.d_x + resist * sign.d_x,
                    r * f_x.d_y + resist * sign.d_y, r * f_x.d_rim + resist * sign.d_rim};

  const double sd_grip =
      load * std::hypot(m.by_friction * ground_.friction_sd,
                        mu * m.by_stiffness / ground_.slip_stiffness * ground_.slip_stiffness_sd);
  const double sd_x = sd_grip * std::fabs(s_x), sd_y = sd_grip * std::fabs(s_y);
  const double sd_roll = load * ground_.rolling_resistance_sd * sign.value;
  const double sd_torque = r * std::sqrt(sd_x * sd_x + sd_roll * sd_roll);
  const double sd_z = sd_grip * rho * std::fabs(s_z);
  Write(out.output[kFx], i, f_x, f_x.value / load, sd_x);
  Write(out.output[kFy], i, f_y, f_y.value / load, sd_y);
  Write(out.output[kFz], i, {load, 0, 0, 0}, 1, 0);
  Write(out.output[kTorque], i, torque, torque.value / load, sd_torque);
  Write(out.output[kMz], i, m_z, m_z.value / load, sd_z);
  Write(out.output[kSinkage], i, {}, 0, 0);
}

}  // namespace grouser::surrogate
