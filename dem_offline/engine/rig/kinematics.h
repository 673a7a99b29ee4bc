#pragma once

namespace grouser::dem {

/// Motion of the hub in the contact frame and of the rim.
struct Motion {
  double v_x, v_y, rim;  ///< [m/s]
};

/// Slips that a motion can have at an attack angle beta: with c = cos(beta) and
/// max(|rim|, V) = 1, slip = (rim - V c)/max(|rim|, V) is in [-1 - max(c, 0), 1 + max(-c, 0)].
/// The same range as surrogate::SlipsAt, which queries and jobs use; a test compares
/// both on one grid.
struct SlipRange {
  double low, high;
};
SlipRange SlipsAt(double attack_angle_rad);

/// Motion with max(|rim|, V) = speed, slip = (rim - v_x)/max(|rim|, V) and attack
/// angle beta = atan2(v_y, v_x), |beta| <= pi; beyond pi/2 the wheel backs. Where the
/// rim counter-rotates, a motion with a rim faster than the hub shares its slip with
/// one whose hub is the faster: that one is meant. Throws std::invalid_argument for
/// what no motion has.
Motion MotionAt(double slip, double attack_angle_rad, double speed_m_per_s);

/// The slip of a motion; 0 for a static wheel.
double SlipOf(const Motion& m);

}  // namespace grouser::dem
