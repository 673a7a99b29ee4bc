#pragma once

#include <array>

#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// Slips that a motion can have at an attack angle beta: with c = cos(beta),
/// [-1 - max(c, 0), 1 + max(-c, 0)]. Queries, jobs and fits refuse what is outside;
/// dem::SlipsAt is the engine's, which includes nothing of ours: a test compares both.
struct SlipRange {
  double low, high;
};
SlipRange SlipsAt(double attack_angle_rad) noexcept;

/// A wheel state without its speed and without its mirrors: v_x, v_y and rim
/// speed over M = max(|rim|, V), mirrored so that forward >= 0, lateral >= 0.
/// Models answer in this half-space; the signs bring the answer back, so that
/// both mirror symmetries hold to the last bit.
struct Canonical {
  double forward;  ///< v_x / M in [0, 1]
  double lateral;  ///< |v_y| / M in [0, 1]
  double rim;      ///< r w / M in [-1, 1]
  double speed;    ///< M [m/s]
  double sign_x;   ///< multiplies f_x, torque, m_z; 0 where symmetry makes them 0
  double sign_y;   ///< multiplies f_y, m_z; 0 where symmetry makes them 0
};

/// Precondition: finite input, not all zero.
Canonical ToCanonical(double v_x, double v_y, double rim_speed) noexcept;

/// Brings outputs of the canonical half-space back to the state's own.
inline void ApplyMirrors(const Canonical& state, std::array<double, kOutputs>* value) noexcept {
  std::array<double, kOutputs>& v = *value;
  v[kFx] = v[kFx] * state.sign_x + 0.0;  // + 0.0: never -0
  v[kTorque] = v[kTorque] * state.sign_x + 0.0;
  v[kFy] = v[kFy] * state.sign_y + 0.0;
  v[kMz] = v[kMz] * (state.sign_x * state.sign_y) + 0.0;
}

/// Coordinates of the canonical state in the chart of the residual table:
/// direction = atan2(rim, forward) in [-pi/2, pi/2],
/// lateral = atan2(lateral, hypot(rim, forward)) in [0, pi/2].
/// At attack angle 0, direction is pi/4 at slip 0, pi/2 at slip 1, 0 for the
/// locked wheel and -pi/4 at full counter-rotation.
struct ChartPoint {
  double direction_rad, lateral_rad;
};
ChartPoint ToChart(const Canonical& state) noexcept;

}  // namespace grouser::surrogate
