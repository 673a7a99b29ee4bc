#include "dem_offline/engine/rig/kinematics.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace grouser::dem {

SlipRange SlipsAt(double attack_angle_rad) {
  const double c = std::cos(attack_angle_rad);
  return {-1 - std::max(c, 0.0), 1 + std::max(-c, 0.0)};
}

Motion MotionAt(double slip, double attack_angle_rad, double speed_m_per_s) {
  constexpr double kRounding = 1e-9;  // slack at the edges of what is possible
  const SlipRange range = SlipsAt(attack_angle_rad);
  if (!(std::abs(attack_angle_rad) <= M_PI + kRounding) || !(slip >= range.low - kRounding) ||
      !(slip <= range.high + kRounding)) {
    throw std::invalid_argument("slip: " + std::to_string(slip) + " at an attack angle of " +
                                std::to_string(attack_angle_rad) + " rad, expected a slip in [" +
                                std::to_string(range.low) + ", " + std::to_string(range.high) +
                                "] and an angle in [-pi, pi]");
  }
  double c = std::cos(attack_angle_rad);
  if (std::abs(c) < 1e-15) c = 0;  // pi/2 has no exact double
  const double s = std::sin(attack_angle_rad), rim = slip + c;
  double hub = speed_m_per_s;
  if (std::abs(rim) > 1 + kRounding) {  // the rim is the faster, in the sense of travel
    hub *= std::max(0.0, ((rim > 0 ? 1 : -1) - slip) / c);
  }
  return {hub * c, hub * s, std::clamp(rim, -1.0, 1.0) * speed_m_per_s};
}

double SlipOf(const Motion& m) {
  const double scale = std::max(std::abs(m.rim), std::hypot(m.v_x, m.v_y));
  return scale > 0 ? (m.rim - m.v_x) / scale : 0.0;
}

}  // namespace grouser::dem
