#pragma once

namespace grouser::dem {

/// Motion of the hub in the contact frame and of the rim.
struct Motion {
  double v_x, v_y, rim;  ///< [m/s]
};

/// Motion with max(|rim|, V) = speed, slip = (rim - v_x)/max(|rim|, V) and
/// attack angle beta = atan2(v_y, v_x). The rim is the faster where slip > 1 -
/// cos(beta). Throws std::invalid_argument for a slip that no motion has at
/// this angle.
Motion MotionAt(double slip, double attack_angle_rad, double speed_m_per_s);

/// The slip of a motion; 0 for a static wheel.
double SlipOf(const Motion& m);

}  // namespace grouser::dem
