#pragma once

#include "grouser/v1alpha1/state.pb.h"

namespace grouser::client {

/// Adds one state as velocities in the contact frame: hub v_x (forward), v_y
/// (left), rim speed r w, all [m/s]; vertical load [N]. One message holds one
/// form: adding the other form drops the kinematics given before.
inline void AddVelocityState(double v_x, double v_y, double rim_speed, double load_n,
                             v1alpha1::WheelStates* states) {
  states->mutable_velocity()->add_v_x_m_per_s(v_x);
  states->mutable_velocity()->add_v_y_m_per_s(v_y);
  states->mutable_velocity()->add_rim_speed_m_per_s(rim_speed);
  states->add_load_n(load_n);
}

/// Adds one state as slip [-] (see SlipForm) and attack angle [rad] at the
/// model's training speed; vertical load [N].
inline void AddSlipState(double slip, double attack_angle_rad, double load_n,
                         v1alpha1::WheelStates* states) {
  states->mutable_slip()->add_slip(slip);
  states->mutable_slip()->add_attack_angle_rad(attack_angle_rad);
  states->add_load_n(load_n);
}

}  // namespace grouser::client
