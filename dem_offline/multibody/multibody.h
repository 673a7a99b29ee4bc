#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "dem_offline/engine/world/rigid_body.h"
#include "dem_offline/multibody/spec.h"

namespace grouser::dem {

/// Of a body's origin, world axes.
struct BodyPlacement {
  Vec3d position_m;
  Quatd orientation;  ///< body to world
};
struct BodyVelocity {
  Vec3d velocity_m_per_s, spin_rad_per_s;
};

/// Energies [J]; sums since time zero. What the bodies gained is what came in:
///   mechanical - mechanical(0) = grains + drives + actuators - dissipated
/// but for the integrator's error, which falls with dt^2.
struct MultibodyEnergy {
  double kinetic = 0, gravity = 0, springs = 0;  ///< at the time of the last forces
  double grains = 0;                             ///< done by the wrenches on the bodies
  double drives = 0;                             ///< by prescribed motions and by joints that lock
  double actuators = 0;                          ///< by the functions of time of the springs
  double dissipated = 0;                         ///< in dampers
  double Mechanical() const { return kinetic + gravity + springs; }
  double Balance() const { return Mechanical() - grains - drives - actuators + dissipated; }
};

/// All that changes, for checkpoints: a system made from the same spec goes on from it with the
/// same bits.
struct MultibodyState {
  double time_s = 0, last_dt_s = 0;
  std::vector<double> coordinates, speeds;  ///< of all bodies, as Simbody orders them
  std::vector<std::uint8_t> locked;         ///< by joint
  MultibodyEnergy energy, power;            ///< powers of the last forces [W]
};

/// Rigid bodies in joints, advanced with the leapfrog of the DEM by Simbody's equations of motion
/// (Sherman, Seth & Delp 2011). In generalized coordinates q and
/// speeds u, with the mass matrix M, forces f of gravity, springs and grains (wrenches W_n of the
/// poses q_n), constraint Jacobian G and q' = N(q) u:
///   kick   M(q_n) (u_{n+1/2} - u_{n-1/2})/dt + G^T lambda = f(t_n, q_n, u_n, W_n),
///          u_n = (u_{n-1/2} + u_{n+1/2})/2, by iteration to rounding;
///   drift  q_{n+1} = q_n + dt N((q_n + q_{n+1})/2) u_{n+1/2};
///   close  where loops are closed, q_{n+1} is projected onto them (1e-12 m) and u_{n+1/2}
///          corrected by N^-1 dq/dt (SHAKE: Hairer, Lubich & Wanner 2006).
/// The step is symmetric in time and of second order in positions, and in velocities read at
/// half steps. (Simbody's own integrators keep velocities and forces at whole steps: their bodies
/// would need the grains' forces of the end of a step, which depend on where the bodies are.)
/// The step is tied to the DEM's; it must resolve the stiffest spring: dt < 2/omega.
class MultibodySystem {
 public:
  /// Throws std::invalid_argument: CheckMultibody, joints whose frames are apart (more than
  /// 1e-6 m or rad from what the joint leaves free), velocities that a joint does not leave free.
  explicit MultibodySystem(const MultibodySpec& spec);
  ~MultibodySystem();
  MultibodySystem(MultibodySystem&&) noexcept;
  MultibodySystem& operator=(MultibodySystem&&) noexcept;

  /// One step. wrenches: by body, of the grains in the present pose, at the body's origin, world
  /// axes; empty: none. The first call starts the leapfrog: the speeds of time zero get half a
  /// kick. Throws std::runtime_error where no state follows (dampers too stiff for the step,
  /// ends of a spring that meet, a loop that can not be closed) and leaves the state as it was.
  void Advance(double dt_s, const std::vector<Wrench>& wrenches = {});

  const MultibodySpec& spec() const;
  double time_s() const;
  int bodies() const;
  /// Throws std::invalid_argument for a name that there is not; so do all that take names.
  int BodyNumber(const std::string& name) const;
  BodyPlacement Placement(int body) const;  ///< at time_s()
  BodyVelocity Velocity(int body) const;    ///< half a step before

  /// Coordinates and rates of a joint (JointType says which; rates of kSpherical are the angular
  /// velocity in the parent's frame): at time_s(), and of the half step before it.
  std::vector<double> Coordinates(const std::string& joint) const;
  std::vector<double> Rates(const std::string& joint) const;

  // Of the time of the last forces, time_s() - dt; reactions and springs are zero before the first
  // step and after Restore.
  /// What the joint does to its child, at the origin of the child's joint frame, world axes:
  /// force and moment of constraint, and of its drive or lock; springs not. Where a loop has more
  /// constraints than it needs (a plane linkage), the one of least squares.
  Wrench Reaction(const std::string& joint) const;
  /// The same in a frame fixed to a body (kGround: the world).
  Wrench ReactionIn(const std::string& joint, const std::string& body,
                    const JointFrame& frame) const;
  double SpringForce(const std::string& spring) const;   ///< tension [N], or torque on the child
  double SpringLength(const std::string& spring) const;  ///< [m], or angle [rad]
  MultibodyEnergy Energy() const;
  /// Linear momentum, and angular about the world's origin [kg m/s, kg m^2/s], half a step before
  /// time_s().
  std::array<Vec3d, 2> Momentum() const;
  /// Largest distance [m] (or angle [rad]) by which a closed loop gapes at time_s().
  double Gap() const;

  /// A joint that locks stops within the step: the drive's work is the energy taken.
  void SetLocked(const std::string& joint, bool locked);

  MultibodyState Save() const;
  /// Throws std::invalid_argument for a state of another system.
  void Restore(const MultibodyState& state);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A wrench at the origin of one frame, in that of another: p is the origin of `to` and q its
/// orientation, in the axes of the wrench, from its point.
Wrench WrenchIn(const Wrench& w, const Vec3d& p, const Quatd& q);

}  // namespace grouser::dem
