#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dem_offline/engine/core/vec3d.h"
#include "dem_offline/engine/world/rigid_body.h"
#include "dem_offline/engine/world/world_types.h"

// Joints and springs of an experiment as plain structs, and the interface of what moves the bodies
// in them. The engine solves no joints: dem_offline/multibody does.

namespace grouser::dem {
class World;
}

namespace grouser::dem::experiment {

struct Experiment;
struct BuiltBody;

/// A part of a programme of a rate or a force: goes to `value` within the ramp (as 1/2 - 1/2 cos)
/// and stays there; after the last one it is 0.
struct ProgrammePart {
  double value = 0, ramp_s = 0, for_s = 0;  ///< for_s: with its ramp; infinite: for ever
};
double ValueAt(const std::vector<ProgrammePart>& programme, double time_s);

/// Holds two bodies together. Coordinates: of the child against the parent, 0 at the start.
struct Joint {
  enum class Kind { kRevolute, kTranslational, kSpherical, kUniversal, kPlanar, kWeld };
  std::string name;
  Kind kind = Kind::kRevolute;
  std::string parent;  ///< empty: the world
  std::string child;
  Vec3d at_m = {0, 0, 0};  ///< in the child's body coordinates
  Vec3d axis = {0, 0, 1};  ///< of the world, as the bodies stand at the start
  bool locked = false;
  std::vector<ProgrammePart> drive;  ///< rate [m/s, rad/s] of a slide or a turn; none: free
};

/// Spring, damper and actuator. Linear: tension k (l - l_0) + c dl/dt - F(t) between two points.
/// Rotational: torque -k (theta - theta_0) - c dtheta/dt + T(t) on the child of a revolute joint.
struct Spring {
  std::string name;
  bool rotational = false;
  std::string a, b;                              ///< bodies; empty: the world
  Vec3d at_a_m = {0, 0, 0}, at_b_m = {0, 0, 0};  ///< in body coordinates
  std::string joint;                             ///< rotational
  double stiffness = 0, damping = 0;             ///< N/m, N s/m; N m/rad, N m s/rad
  double rest = 0;                               ///< l_0 (< 0: as it stands), theta_0
  std::vector<ProgrammePart> force;              ///< F [N] pushes apart, T [N m]
};

struct JointReading {
  std::vector<double> coordinates, rates;
  double gap_m = 0;  ///< by which the bodies of the world are apart where the joint holds them
};
struct SpringReading {
  double force = 0;   ///< tension [N], or torque on the child [N m]
  double extent = 0;  ///< length [m], or angle [rad]
};

/// Moves the bodies of a world that joints and springs name, in step with it.
class Mechanism {
 public:
  virtual ~Mechanism() = default;
  virtual void Advance() = 0;  ///< before World::Step, which then moves the bodies so
  /// On the child, at the joint, axes of the world: of the step that was made last.
  virtual Wrench Reaction(std::size_t joint) const = 0;
  virtual JointReading ReadJoint(std::size_t joint) const = 0;
  virtual SpringReading ReadSpring(std::size_t spring) const = 0;
};

struct JointedBody {
  std::size_t body;        ///< of the experiment
  const BuiltBody* built;  ///< where it stands at the start
  int in_world;
};
/// Makes it. world null: only to see whether it can be made. Throws std::invalid_argument.
using MechanismFn = std::function<std::unique_ptr<Mechanism>(
    const Experiment& e, World* world, const std::vector<JointedBody>& bodies)>;

/// Whether a joint or a spring names the body, which then moves by them alone.
bool IsJointed(const Experiment& e, const std::string& body);

/// Of the coordinates of a joint in tables; angles in radians.
std::vector<std::string> CoordinateNames(Joint::Kind kind);

/// Throws SpecError for joints and springs that cannot be. `e` is Resolved.
void CheckJoints(const Experiment& e);

/// Time step that resolves the springs and dampers [s]; infinite: none.
double SpringStep(const Experiment& e);

/// The mechanism of the bodies in a world; null: none is asked for. numbers: of the bodies in the
/// world.
std::unique_ptr<Mechanism> MakeMechanism(const Experiment& e, World* world,
                                         const std::vector<BuiltBody>& built,
                                         const std::vector<int>& numbers);

}  // namespace grouser::dem::experiment
