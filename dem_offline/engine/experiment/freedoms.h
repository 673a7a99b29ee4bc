#pragma once

#include <array>
#include <string>

#include "dem_offline/engine/experiment/experiment.h"
#include "dem_offline/engine/experiment/shapes.h"

// Degrees of freedom of a body in a step of its program, as a rig gives them: each axis of the
// world, and the spin about the body's own axle, is prescribed or free.

namespace grouser::dem::experiment {

/// Whether a step leaves an axis or the spin about the axle free (`release` is another matter).
bool HasFreedom(const MotionStep& step);

/// What moves with a free axis, and about the axle (the body's own y axis through its origin).
struct FreeMass {
  double mass_kg = 0;
  double axle_inertia_kg_m2 = 0;
  Vec3d centre_m = {0, 0, 0};  ///< of mass, in the body coordinates of the file
};
/// From mass_kg, centre_m and inertia_kg_m2 of a body, or from its parts and the density. Throws
/// SpecError naming `field`.mass_kg where there is no mass.
FreeMass FreeMassOf(const BodySpec& body, const Material& material, const std::string& field);

/// Throws SpecError for freedoms that contradict the rest of a step (`at`: its field), or lack a
/// mass.
void CheckFreedoms(const Experiment& e, const std::string& at, const BodySpec& body,
                   const MotionStep& step);

/// The free axes of one body, by the leapfrog of the world: velocities of half steps,
///   m dv_k/dt = F_k + P_k - m g_k (k = z),   I dw/dt = a . T + Q,
/// F, T [N, N m]: of the grains; P, Q: applied_force_n, applied_torque_n_m; a: unit vector of the
/// axle, I [kg m^2] about it. What a rig takes up elsewhere has no effect.
class Freedoms {
 public:
  /// A new step of the program; before: the last one, or null. An axis that was free goes on, one
  /// that becomes free begins with the velocity that it has. The way begins anew.
  void Enter(const MotionStep* before, const MotionStep& step, const Vec3d& velocity_m_per_s,
             double axle_rad_per_s);
  /// Before a step of time: puts the free parts into a prescribed motion. force, torque: of the
  /// grains at the present pose.
  void Advance(const MotionStep& step, const FreeMass& mass, const Vec3d& force_n,
               const Vec3d& torque_n_m, const Vec3d& axle, double gravity_m_per_s2, double dt_s,
               Vec3d* velocity_m_per_s, Vec3d* spin_rad_per_s);

  /// Since the step of the program began: how far it is from there along free axes, level ones
  /// where there are any [m]; its turn about the axle [rad].
  double Way(const MotionStep& step) const;
  double turn_rad() const { return turn_; }
  /// Over twice the square of sqrt(g d) this is the kinetic energy over m g d.
  double Speed2(const MotionStep& step) const;

 private:
  Vec3d velocity_ = {0, 0, 0}, shift_ = {0, 0, 0};
  double spin_ = 0, turn_ = 0;
  /// Newly free: the first kick takes half a step, from a velocity of the present time.
  std::array<bool, 3> first_ = {true, true, true};
  bool first_spin_ = true;
};

}  // namespace grouser::dem::experiment
