#pragma once

#include <cmath>
#include <limits>

#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// What a state in the slip form of a query means. At speed 0 the wheel is at rest, whatever the
/// slip; NaN: no motion has this slip (FromSlip), or a number is not finite or negative.
inline VelocityState AskedMotion(double slip, double attack_angle_rad, double speed) noexcept {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  if (speed > 0) return FromSlip(slip, attack_angle_rad, speed);
  const bool rests = speed == 0 && std::isfinite(slip) && std::isfinite(attack_angle_rad);
  return rests ? VelocityState{0, 0, 0} : VelocityState{kNaN, kNaN, kNaN};
}

}  // namespace grouser::surrogate
