#pragma once

// The one place that knows Simbody's types; included by two of this folder's sources alone. Its
// headers take seconds to compile, and are C++17: in C++20 their == are ambiguous.
#include <simbody/internal/Constraint_Weld.h>
#include <simbody/internal/Force_Custom.h>
#include <simbody/internal/Force_Gravity.h>
#include <simbody/internal/GeneralForceSubsystem.h>
#include <simbody/internal/MobilizedBody_BuiltIns.h>
#include <simbody/internal/Motion.h>
#include <simbody/internal/MultibodySystem.h>
#include <simbody/internal/SimbodyMatterSubsystem.h>
#include <simmath/MultibodyGraphMaker.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "dem_offline/multibody/multibody.h"

namespace grouser::dem {

inline SimTK::Vec3 ToSimbody(const Vec3d& v) { return {v[0], v[1], v[2]}; }
inline Vec3d FromSimbody(const SimTK::Vec3& v) { return {v[0], v[1], v[2]}; }
inline SimTK::Transform ToSimbody(const Vec3d& position, const Quatd& q) {
  return {SimTK::Rotation(SimTK::Quaternion(q[0], q[1], q[2], q[3])), ToSimbody(position)};
}

/// What a driven or locked joint does in the present step; [its speeds].
struct DrivenMotion {
  std::vector<double> coordinate, rate, acceleration;
};

struct ModelJoint {
  const JointSpec* spec = nullptr;
  SimTK::MobilizedBody mobilizer;
  SimTK::Motion motion;   ///< empty for kSpherical and kWeld
  bool reversed = false;  ///< the mobilizer leads from the child to the parent
  bool locked = false;
  std::unique_ptr<DrivenMotion> drive = std::make_unique<DrivenMotion>();
  bool Driven() const { return locked || !spec->coordinate.empty() || !spec->rate.empty(); }
};

/// What a spring does in a state: `rate` of its length or angle, `force` tension or torque.
struct SpringLoad {
  double extent = 0, rate = 0, force = 0;
};

/// A spring of either kind with its actuator's value of the present step.
struct ModelSpring {
  const LinearSpringSpec* linear = nullptr;
  const RotationalSpringSpec* rotational = nullptr;
  SimTK::MobilizedBody a, b;          ///< linear: its bodies
  const ModelJoint* joint = nullptr;  ///< rotational
  double actuator = 0;
  double Stiffness() const;
  double Damping() const;
  double Free() const;
  SpringLoad Load(const SimTK::State& state) const;
  void Apply(const SimTK::State& state, SimTK::Vector_<SimTK::SpatialVec>& forces) const;
};

/// The spec as a tree of Simbody's mobilizers; loops are cut through a body, whose parts share
/// its mass and are welded together (MultibodyGraphMaker), so that every joint has coordinates.
struct Model {
  explicit Model(const MultibodySpec& given);
  Model(const Model&) = delete;

  const MultibodySpec spec;
  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter{system};
  SimTK::GeneralForceSubsystem forces{system};
  SimTK::Force::Gravity gravity;
  std::vector<SimTK::MobilizedBody> bodies;  ///< by number; of a cut body its first part
  std::vector<ModelJoint> joints;            ///< in the order of the spec
  std::vector<ModelSpring> springs;          ///< linear ones, then rotational ones
  std::map<std::string, int> body_numbers, joint_numbers, spring_numbers;
  std::vector<Wrench> wrenches;  ///< on the bodies in the present step; or empty
  bool loops = false;
  SimTK::State initial;  ///< poses and velocities of the spec

 private:
  struct Placed;
  void AddMobilizers(std::vector<Placed>* placed);
  void AddSprings();
  void FitInitialState(const std::vector<Placed>& placed);
  SimTK::MobilizedBody BodyOf(const std::string& name);
};

}  // namespace grouser::dem
