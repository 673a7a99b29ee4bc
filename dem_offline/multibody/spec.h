#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "dem_offline/engine/core/vec3d.h"

// Rigid bodies, joints, springs and drives as plain values; docs/multibody.md.

namespace grouser::dem {

/// The name of the body that does not move; no body of a spec may have it.
inline constexpr const char* kGround = "ground";

/// A value at a time [s]; empty: none.
using TimeFunction = std::function<double(double time_s)>;

/// A rigid body. The origin of its frame need not be its mass centre.
struct MultibodyBody {
  std::string name;
  double mass_kg = 0;                   ///< > 0
  Vec3d centre_of_mass_m = {0, 0, 0};   ///< in the body frame
  Vec3d inertia_kg_m2 = {0, 0, 0};      ///< I_xx, I_yy, I_zz about the mass centre, body axes
  Vec3d inertia_off_kg_m2 = {0, 0, 0};  ///< I_xy, I_xz, I_yz: elements of the tensor, not
                                        ///< the products of inertia of opposite sign
  Vec3d position_m = {0, 0, 0};         ///< of the origin, at time zero, world axes
  Quatd orientation = {1, 0, 0, 0};     ///< body to world
  Vec3d velocity_m_per_s = {0, 0, 0};   ///< of the origin
  Vec3d spin_rad_per_s = {0, 0, 0};     ///< world axes
};

/// What a joint leaves free. Coordinates, in order (angle of the child against the parent [rad],
/// displacement of the child's frame in the parent's [m]; 0 where both frames coincide):
enum class JointType {
  kRevolute,       ///< [angle about z]
  kTranslational,  ///< [displacement along z]
  kSpherical,      ///< [quaternion w, x, y, z of the child in the parent's frame]
  kUniversal,      ///< [angle about the parent's x, then about the child's y]; shafts along z
  kPlanar,         ///< [angle about z, displacement along the parent's x, along its y]
  kWeld,           ///< [] nothing
};

/// A frame fixed to a body (kGround: to the world).
struct JointFrame {
  Vec3d position_m = {0, 0, 0};
  Quatd orientation = {1, 0, 0, 0};  ///< joint axes to body axes
};

/// Holds two bodies together. At time zero the frames must lie so that the joint can join them:
/// they are never moved to fit.
struct JointSpec {
  std::string name;
  JointType type = JointType::kRevolute;
  std::string parent = kGround, child;
  JointFrame in_parent, in_child;
  /// Prescribed motion: none, or one function for each free coordinate (all or none). Either the
  /// coordinates as functions of time, which at time zero must be those of the bodies' poses, or
  /// their rates. Not for kSpherical and kWeld.
  std::vector<TimeFunction> coordinate, rate;
  /// Holds its coordinates until MultibodySystem::SetLocked. Not for kSpherical and kWeld.
  bool locked = false;
};

/// Spring, damper and actuator along the line between two points. Tension [N]:
///   f = k (l - l_0) + c dl/dt - F(t),
/// l the distance of the points; F > 0 pushes the ends apart.
struct LinearSpringSpec {
  std::string name;
  std::string body_a = kGround, body_b;
  Vec3d point_a_m = {0, 0, 0}, point_b_m = {0, 0, 0};  ///< in the body's frame
  double stiffness_n_per_m = 0, damping_n_s_per_m = 0, free_length_m = 0;
  TimeFunction force_n;
};

/// Spring, damper and actuator about the axis of a joint. Torque on the child [N m]:
///   T = -k (theta - theta_0) - c dtheta/dt + T_a(t),
/// and -T on the parent. theta runs on over whole turns; it begins in [-pi, pi].
struct RotationalSpringSpec {
  std::string name;
  std::string joint;   ///< kRevolute, kPlanar or kUniversal
  int coordinate = 0;  ///< which angle; 1 for the second of kUniversal
  double stiffness_n_m_per_rad = 0, damping_n_m_s_per_rad = 0, free_angle_rad = 0;
  TimeFunction torque_n_m;
};

struct MultibodySpec {
  std::vector<MultibodyBody> bodies;
  std::vector<JointSpec> joints;  ///< a body without any is free; loops are closed
  std::vector<LinearSpringSpec> linear_springs;
  std::vector<RotationalSpringSpec> rotational_springs;
  Vec3d gravity_m_per_s2 = {0, 0, -9.81};
};

/// A joint whose frames coincide at time zero: their origin at a point of the world, their z
/// along `axis` (not null), their x along the part of `across` that is normal to it; where that
/// vanishes, along any normal. Throws std::invalid_argument for an unknown body or a null axis.
JointSpec JointAt(const MultibodySpec& spec, const std::string& name, JointType type,
                  const std::string& parent, const std::string& child, const Vec3d& point_m,
                  const Vec3d& axis, const Vec3d& across = {1, 0, 0});

/// Throws std::invalid_argument with what, where and what was expected: names that are empty,
/// taken or unknown, numbers that are not finite, a mass that is not > 0, an inertia that no mass
/// has (a principal moment not > 0, or above the sum of the two others), quaternions of no unit
/// length, functions of time that a joint can not follow, springs of negative stiffness. Whether
/// frames meet is MultibodySystem's to see.
void CheckMultibody(const MultibodySpec& spec);

}  // namespace grouser::dem
