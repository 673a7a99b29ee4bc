#include "surrogate/models/hull.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "surrogate/models/hull_parts.h"

namespace grouser::surrogate {

Hull::Hull(const TrainingDomain& box, const Uncertainty& uncertainty)
    : box_(box),
      uncertainty_(uncertainty),
      middle_load_(std::sqrt(box.load_min_n * box.load_max_n)) {
  if (!(box.load_min_n > 0) || !(box.load_max_n >= box.load_min_n) ||
      !std::isfinite(box.load_max_n)) {
    throw std::invalid_argument("domain: load_min_n and load_max_n: expected 0 < min <= max");
  }
  if (!(box.slip_max >= box.slip_min) || !(box.attack_angle_max_rad >= 0)) {
    throw std::invalid_argument("domain: slip or attack angle range is empty");
  }
  if (!(box.gravity_m_per_s2 > 0)) {
    throw std::invalid_argument("soil: gravity_m_per_s2: expected a positive number");
  }
}

std::uint32_t FacesBeyond(const TrainingDomain& box, const Canonical& s, double load) noexcept {
  constexpr double kEdge = Hull::kEdge;
  const double slip = s.rim - s.forward;
  const double hub = std::sqrt(s.forward * s.forward + s.lateral * s.lateral);
  const double angle = hub == 0 ? 0 : std::atan2(s.lateral, s.forward);
  // Counter-rotation with the rim the faster shares its slip with a state
  // where the hub is; runs are made for the latter.
  const bool other_sheet = s.rim < 0 && hub < 1 - kEdge;
  return (slip < box.slip_min - kEdge ? kBelowSlip : 0u) |
         (slip > box.slip_max + kEdge ? kAboveSlip : 0u) | (other_sheet ? kOtherSheet : 0u) |
         (angle > box.attack_angle_max_rad + kEdge ? kAboveAngle : 0u) |
         (load < box.load_min_n * (1 - kEdge) ? kBelowLoad : 0u) |
         (load > box.load_max_n * (1 + kEdge) ? kAboveLoad : 0u);
}

bool Hull::Outside(const Canonical& s, double load) const noexcept {
  return FacesBeyond(box_, s, load) != 0;
}

double Hull::Fastest(double radius_m) const noexcept {
  if (!(box_.froude_max > 0)) return std::numeric_limits<double>::infinity();
  return std::sqrt(box_.froude_max * box_.gravity_m_per_s2 * radius_m);
}

ExcessParts ExcessOf(const TrainingDomain& box, const Canonical& s, double load,
                     double fastest) noexcept {
  // Slip and attack angle jump where a mirror takes over (v_x = 0). Braking
  // excess is weighted by the share of v_x, driving excess by that of the rim,
  // which is even there; |v_y|/M stands for the angle.
  const double plane = std::sqrt(s.forward * s.forward + s.rim * s.rim);
  const double hub_share = plane > 0 ? s.forward / plane : 0;
  const double rim_share = plane > 0 ? std::fabs(s.rim) / plane : 0;
  const double driving = std::fabs(s.rim) - (s.rim < 0 ? -s.forward : s.forward);
  const double most_lateral =
      box.attack_angle_max_rad < std::numbers::pi / 2 ? std::sin(box.attack_angle_max_rad) : 1.0;
  const auto beyond = [](double over) { return over > 0 ? over : 0.0; };
  const double fast = beyond(s.speed / fastest - 1);
  return {(beyond(box.slip_min - (s.rim - s.forward)) * hub_share +
           beyond(driving - box.slip_max) * rim_share) /
              Hull::kSlipReach,
          beyond(s.lateral - most_lateral) / Hull::kLateralReach,
          (beyond(std::log(box.load_min_n / load)) + beyond(std::log(load / box.load_max_n))) /
              Hull::kLogLoadReach,
          std::fmin(fast, Hull::kMostSpeedExcess) / Hull::kSpeedReach};
}

double Hull::Excess(const Canonical& s, double load, double radius_m) const noexcept {
  return ExcessOf(box_, s, load, Fastest(radius_m)).Sum();
}

double Hull::Bulldozing(const Canonical& s) noexcept {
  const double plane = std::sqrt(s.forward * s.forward + s.rim * s.rim);
  const double brake = s.forward > s.rim ? s.forward - s.rim : 0;
  const double share = s.lateral * s.lateral + (plane > 0 ? brake * brake * s.forward / plane : 0);
  return share < 1 ? share : 1;
}

void Hull::AddUncertainty(double distance, double bulldozing, double load,
                          WheelAnswer* answer) const noexcept {
  const double ratio = load / middle_load_;
  for (int o = 0; o < kOutputs; ++o) {
    const double scale =
        (o == kSinkage ? 1 : ratio) * (1 + uncertainty_.bulldozing[o] * bulldozing);
    const double grown = uncertainty_.fit_growth[o] * distance;
    const double inside = uncertainty_.fit_inside[o];
    const double patch = uncertainty_.patch[o], fit2 = inside * inside + grown * grown;
    answer->sd_fit[o] = scale * std::sqrt(fit2);
    answer->sd_patch[o] = scale * patch;
    answer->half_width[o] =
        scale * (uncertainty_.interval_factor[o] * std::sqrt(fit2 + patch * patch));
  }
}

}  // namespace grouser::surrogate
