#pragma once

#include <string>
#include <vector>

#include "dem_offline/engine/world/world.h"
#include "dem_offline/multibody/multibody.h"

namespace grouser::dem {

/// A body of a World moves as one of a MultibodySystem; both have the same origin and axes.
struct BodyLink {
  std::string body;
  int world_body = 0;  ///< several may move as one
};

/// A World and a MultibodySystem in step. Both are leapfrogs on one clock:
///   W_n, the grains' wrenches at the poses q_n, give u_{n+1/2} and q_{n+1} (Advance);
///   the World's bodies get the velocity and spin that lead from q_n to q_{n+1},
///     v = (x_{n+1} - x_n)/dt, w from (1, w dt/2) ~ orientation_{n+1} orientation_n^-1
///     (the engine's Turn solved for w),
///   and make the step with the grains, whose forces W_{n+1} then are those of q_{n+1}.
/// Force and counterforce are of the same instant and pose: linear momentum of grains and bodies
/// is kept to rounding, and the scheme is of second order, like the engine's own free bodies.
class CoupledBodies {
 public:
  /// Keeps pointers to both. Sets the poses and velocities of the World's bodies, whose motion
  /// must be kPrescribed. Throws std::invalid_argument: a body that is not there or is linked
  /// twice, gravity that differs, a World that a device steps.
  CoupledBodies(World* world, MultibodySystem* bodies, const std::vector<BodyLink>& links);

  /// One step of both, of the World's dt. After a fault of the World nothing moves.
  StepFault Step();
  /// Its first part: the bodies have moved, and the World's have the velocities that follow them.
  void Advance();

 private:
  struct Link {
    int body, world_body;
  };
  void Steer();

  World* world_;
  MultibodySystem* bodies_;
  std::vector<Link> links_;
};

}  // namespace grouser::dem
