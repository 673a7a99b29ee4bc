#include "surrogate/vehicle/motor.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace grouser::vehicle {

MotorState StateOf(const Motor& m, double torque_n_m, double spin_rad_per_s) noexcept {
  const bool braking = torque_n_m * spin_rad_per_s < 0;
  const double through = braking ? torque_n_m * m.efficiency : torque_n_m / m.efficiency;
  MotorState state{};
  state.use = std::fabs(torque_n_m) / m.torque_limit_n_m;
  if (m.torque_constant_n_m_per_a > 0) {
    const double turns = spin_rad_per_s > 0 ? 1 : spin_rad_per_s < 0 ? -1 : 0;
    state.current_a =
        through / (m.gear * m.torque_constant_n_m_per_a) + m.no_load_current_a * turns;
    state.voltage_v =
        m.resistance_ohm * state.current_a + m.torque_constant_n_m_per_a * m.gear * spin_rad_per_s;
    state.electric_power_w = state.voltage_v * state.current_a;
    state.use = std::max({state.use, std::fabs(state.current_a) / m.current_limit_a,
                          std::fabs(state.voltage_v) / m.voltage_limit_v});
  } else {
    state.current_a = state.voltage_v = std::numeric_limits<double>::quiet_NaN();
    state.electric_power_w = through * spin_rad_per_s;
  }
  state.use = std::max(state.use, state.electric_power_w / m.power_limit_w);
  return state;
}

}  // namespace grouser::vehicle
