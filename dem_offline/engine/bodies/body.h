#pragma once

#include "dem_offline/engine/bodies/shape.h"
#include "dem_offline/engine/core/vec3d.h"

namespace grouser::dem {

enum class BodyMotion {
  kFixed,       ///< does not move
  kPrescribed,  ///< moves with `velocity` and `spin`, whatever pushes
  kFree,        ///< rigid body under gravity and the grains' push
};

/// Pose and motion of a rigid body, in double, in the world frame. Velocities
/// live at half steps, as the grains' do.
struct RigidBody {
  int material = 1;
  BodyMotion motion = BodyMotion::kFixed;
  Vec3d position_m = {0, 0, 0};  ///< of the body's origin
  Quatd orientation = {1, 0, 0, 0};
  Vec3d velocity_m_per_s = {0, 0, 0};  ///< of the origin
  Vec3d spin_rad_per_s = {0, 0, 0};    ///< world axes
  // kFree only; the origin is the centre of mass, body axes are principal.
  double mass_kg = 0;
  Vec3d inertia_kg_m2 = {0, 0, 0};
  Vec3d outer_force_n = {0, 0, 0}, outer_moment_n_m = {0, 0, 0};  ///< applied, world axes
};

/// A rigid body of a world.
struct Body : RigidBody {
  Shape shape;
};

}  // namespace grouser::dem
