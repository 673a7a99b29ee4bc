#include "dem_offline/engine/rig/kinematics.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace grouser::dem {

Motion MotionAt(double slip, double attack_angle_rad, double speed_m_per_s) {
  const double c = std::cos(attack_angle_rad), s = std::sin(attack_angle_rad);
  double hub = speed_m_per_s;  // V
  double rim = speed_m_per_s * (slip + c);
  if (slip > 1 - c + 1e-12) {  // the rim is the faster; at 90 degrees and slip 1 it is as fast
    rim = speed_m_per_s;
    hub = std::abs(c) > 1e-9 ? rim * (1 - slip) / c : -1;
  }
  const double tolerance = 1e-9 * speed_m_per_s;
  if (!(hub >= 0) || hub > speed_m_per_s + tolerance || !(std::abs(rim) <= speed_m_per_s + tolerance)) {
    throw std::invalid_argument("slip: " + std::to_string(slip) + " at attack angle " +
                                std::to_string(attack_angle_rad) +
                                " rad, expected -1 - cos(angle) to 1");
  }
  return {hub * c, hub * s, rim};
}

double SlipOf(const Motion& m) {
  const double scale = std::max(std::abs(m.rim), std::hypot(m.v_x, m.v_y));
  return scale > 0 ? (m.rim - m.v_x) / scale : 0.0;
}

}  // namespace grouser::dem
