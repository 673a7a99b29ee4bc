#include "surrogate/models/hybrid.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace grouser::surrogate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kOverloadSinkage = 0.7;  // of the radius: DEM runs end there
constexpr double kEdge = 1e-9;            // rounding at the hull's faces
// One unit of hull distance beyond the box; by judgement, not fitted.
constexpr double kSlipReach = 0.15, kLateralReach = 0.15, kLogLoadReach = 0.3;
constexpr double kFarFromRuns = 0.5;       // hull distance that is flagged
constexpr double kHalfPi = 1.5707963267948966;

double At(std::span<const double> values, std::size_t i, double otherwise) {
  return values.empty() ? otherwise : values[i];
}

void Put(std::span<double> to, std::size_t i, double value) {
  if (!to.empty()) to[i] = value;
}

void WriteNaN(const ResponsesView& out, std::size_t i) {
  for (const OutputView& o : out.output) {
    for (const std::span<double>& part : {o.value, o.sd_fit, o.sd_patch, o.low, o.high}) {
      Put(part, i, kNaN);
    }
  }
}

// Flags of what was given beyond kinematics and load; kInvalid if unusable.
std::uint32_t ContextFlags(const WheelStatesView& in, std::size_t i) {
  const double pitch = At(in.slope_pitch, i, 0), roll = At(in.slope_roll, i, 0);
  const double yaw = At(in.yaw_rate, i, 0);
  if (!std::isfinite(pitch) || !std::isfinite(roll) || !std::isfinite(yaw)) return kInvalid;
  std::uint32_t flags = 0;
  if (pitch != 0 || roll != 0) flags |= kSlope;
  if (yaw != 0) flags |= kClamped;
  if (!in.pass_number.empty() && in.pass_number[i] > 1) flags |= kVirginAssumed;
  return flags;
}

}  // namespace

HybridModel::HybridModel(const BekkerModel& physics, ResidualTable table, const HullBox& hull,
                         const Uncertainty& uncertainty)
    : physics_(physics),
      table_(std::move(table)),
      hull_(hull),
      uncertainty_(uncertainty),
      middle_load_(std::sqrt(hull.load_min_n * hull.load_max_n)) {
  if (!(hull.load_min_n > 0) || !(hull.load_max_n >= hull.load_min_n) ||
      !std::isfinite(hull.load_max_n)) {
    throw std::invalid_argument("domain: load_min_n and load_max_n: expected 0 < min <= max");
  }
  if (!(hull.slip_max >= hull.slip_min) || !(hull.attack_angle_max_rad >= 0)) {
    throw std::invalid_argument("domain: slip or attack angle range is empty");
  }
  if (!(hull.gravity_m_per_s2 > 0)) {
    throw std::invalid_argument("soil: gravity_m_per_s2: expected a positive number");
  }
}

bool HybridModel::OutsideBox(const Canonical& s, double load) const noexcept {
  const double slip = s.rim - s.forward;
  const double hub = std::sqrt(s.forward * s.forward + s.lateral * s.lateral);
  const double angle = hub == 0 ? 0 : std::atan2(s.lateral, s.forward);
  // Counter-rotation with the rim the faster shares its slip with a state
  // where the hub is; runs are made for the latter.
  const bool other_sheet = s.rim < 0 && hub < 1 - kEdge;
  return slip < hull_.slip_min - kEdge || slip > hull_.slip_max + kEdge || other_sheet ||
         angle > hull_.attack_angle_max_rad + kEdge ||
         load < hull_.load_min_n * (1 - kEdge) || load > hull_.load_max_n * (1 + kEdge);
}

double HybridModel::Excess(const Canonical& s, double load) const noexcept {
  // Slip and attack angle jump where a mirror takes over (v_x = 0). Braking
  // excess is weighted by the share of v_x, driving excess by that of the rim,
  // which is even there; |v_y|/M stands for the angle.
  const double plane = std::sqrt(s.forward * s.forward + s.rim * s.rim);
  const double hub_share = plane > 0 ? s.forward / plane : 0;
  const double rim_share = plane > 0 ? std::fabs(s.rim) / plane : 0;
  const double driving = std::fabs(s.rim) - (s.rim < 0 ? -s.forward : s.forward);
  const double most_lateral =
      hull_.attack_angle_max_rad < kHalfPi ? std::sin(hull_.attack_angle_max_rad) : 1.0;
  const auto beyond = [](double over) { return over > 0 ? over : 0.0; };
  return (beyond(hull_.slip_min - (s.rim - s.forward)) * hub_share +
          beyond(driving - hull_.slip_max) * rim_share) / kSlipReach +
         beyond(s.lateral - most_lateral) / kLateralReach +
         (beyond(std::log(hull_.load_min_n / load)) + beyond(std::log(load / hull_.load_max_n))) /
             kLogLoadReach;
}

void HybridModel::AddUncertainty(double distance, double load, Answer* answer) const noexcept {
  const double ratio = load / middle_load_;
  for (int o = 0; o < kOutputs; ++o) {
    const double scale = o == kSinkage ? 1 : ratio;
    const double grown = uncertainty_.fit_growth[o] * distance;
    const double inside = uncertainty_.fit_inside[o];
    const double fit = scale * std::sqrt(inside * inside + grown * grown);
    const double patch = scale * uncertainty_.patch[o];
    answer->sd_fit[o] = fit;
    answer->sd_patch[o] = patch;
    answer->half_width[o] =
        uncertainty_.interval_factor[o] * std::sqrt(fit * fit + patch * patch);
  }
}

HybridModel::Answer HybridModel::EvaluateOne(double v_x, double v_y, double rim_speed,
                                             double load) const noexcept {
  Answer answer{};
  answer.flags = uncertainty_.form_unknown ? kFormUnknown : 0u;
  if (v_x == 0 && v_y == 0 && rim_speed == 0) {
    const BekkerModel::Answer still = physics_.SolveStatic(load);
    answer.value = still.value;
    answer.flags |= kStatic | kExtrapolated;
    if (still.no_equilibrium) answer.flags |= kNoEquilibrium | kClamped;
    AddUncertainty(1, load, &answer);
    return answer;
  }
  const Canonical state = ToCanonical(v_x, v_y, rim_speed);
  const BekkerModel::Answer trend = physics_.SolveCanonical(state, load);
  const double radius = physics_.wheel().radius_m, log_load = std::log(load);
  const auto rest = table_.Evaluate(ToChart(state), log_load);
  answer.value = trend.value;
  for (const Output o : {kFx, kFy, kFz}) answer.value[o] += load * rest[o];
  for (const Output o : {kTorque, kMz}) answer.value[o] += load * radius * rest[o];
  answer.value[kSinkage] += radius * rest[kSinkage];
  if (answer.value[kSinkage] < 0) {
    answer.value[kSinkage] = 0;
    answer.flags |= kClamped;
  }
  ApplyMirrors(state, &answer.value);

  if (trend.no_equilibrium) answer.flags |= kNoEquilibrium | kClamped;
  const double froude =
      state.speed * state.speed / (hull_.gravity_m_per_s2 * radius);
  if (hull_.froude_max > 0 && froude > hull_.froude_max) answer.flags |= kRate;
  double distance = rest[ResidualTable::kDistance] > 0 ? rest[ResidualTable::kDistance] : 0;
  distance += Excess(state, load);
  if (OutsideBox(state, load) || distance > kFarFromRuns ||
      answer.value[kSinkage] > kOverloadSinkage * radius) {
    answer.flags |= kExtrapolated;
  }
  AddUncertainty(distance, load, &answer);
  return answer;
}

void HybridModel::Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept {
  const std::size_t n = in.load.size();
  for (std::size_t i = 0; i < n; ++i) {
    const double v_x = in.v_x[i], v_y = in.v_y[i], rim = in.rim_speed[i], load = in.load[i];
    std::uint32_t flags = ContextFlags(in, i);
    const bool finite = std::isfinite(v_x) && std::isfinite(v_y) && std::isfinite(rim) &&
                        std::isfinite(load) && std::isfinite(std::hypot(v_x, v_y));
    SlipState slip{kNaN, kNaN, false};
    if (finite) slip = ToSlip(v_x, v_y, rim);
    Put(out.slip, i, slip.slip);
    Put(out.attack_angle, i, slip.attack_angle_rad);
    if (!finite || !(load > 0) || (flags & kInvalid) != 0) {
      out.flags[i] = kInvalid;
      WriteNaN(out, i);
      continue;
    }
    const Answer answer = EvaluateOne(v_x, v_y, rim, load);
    out.flags[i] = flags | answer.flags;
    for (int o = 0; o < kOutputs; ++o) {
      const OutputView& to = out.output[o];
      Put(to.value, i, answer.value[o]);
      Put(to.sd_fit, i, answer.sd_fit[o]);
      Put(to.sd_patch, i, answer.sd_patch[o]);
      Put(to.low, i, answer.value[o] - answer.half_width[o]);
      Put(to.high, i, answer.value[o] + answer.half_width[o]);
    }
  }
}

}  // namespace grouser::surrogate
