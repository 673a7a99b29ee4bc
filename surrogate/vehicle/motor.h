#pragma once

#include "surrogate/vehicle/vehicle.h"

namespace grouser::vehicle {

/// What a motor draws for a torque and spin at the wheels; see Motor.
struct MotorState {
  double electric_power_w;
  double current_a, voltage_v;  ///< NaN where the torque constant is unknown
  double use;                   ///< largest of torque, current, voltage, power over its limit
};
MotorState StateOf(const Motor& motor, double torque_n_m, double spin_rad_per_s) noexcept;

}  // namespace grouser::vehicle
