#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "grouser/model.h"

/// A wheel of a multibody simulator on a model's soil: from where the wheel is and how it moves to
/// the force and moment on it. For MuJoCo see docs/mujoco.md. Vectors are in the simulator's world
/// axes, whichever these are; SI and radians.
namespace grouser {

/// How a simulator's wheel meets the ground.
struct ContactOptions {
  /// k of the tyre, in series with the soil [N/m], > 0: sinkage = that of the soil at the load N,
  /// plus N/k. Infinite: a rigid wheel; hard ground, which does not sink, needs a finite one.
  double tyre_stiffness = std::numeric_limits<double>::infinity();
  /// zeta of the normal motion, >= 0 [-]: of a wheel that carries its static load on ground whose
  /// sinkage is proportional to the load, the damping ratio.
  double damping_ratio = 0.5;
  /// sigma over the model's radius, >= 0 [-]: over so much travel slip and slip angle follow the
  /// motion. 0: at once.
  double relaxation_over_radius = 0.3;
  /// zeta_s of the motion along the ground, >= 0 [-]: the damping ratio of a wheel with its static
  /// load that shear holds.
  double shear_damping_ratio = 0.2;
};

/// A wheel in the simulator.
struct WheelMotion {
  std::array<double, 3> centre{};            ///< [m]
  std::array<double, 3> axle{};              ///< along the axle, either way, any length above 0
  std::array<double, 3> velocity{};          ///< of the centre [m/s]
  std::array<double, 3> angular_velocity{};  ///< of the wheel, spin and all [rad/s]
  std::array<double, 3> ground_point{};      ///< any point of the undisturbed ground's plane [m]
  std::array<double, 3> ground_normal{};     ///< out of the ground, any length above 0
  double time_step = 0;                      ///< since the state's last step, >= 0 [s]
};

/// What a wheel remembers between steps: a plain value, to be saved and restored. Zeros: the wheel
/// has not moved since it touched the ground.
struct ContactState {
  double v_x = 0, v_y = 0, rim = 0;  ///< u of WheelContact [-]
};

/// Ground on wheel.
struct WheelForce {
  std::array<double, 3> force{}, moment{};       ///< at the wheel's centre, world axes [N], [N m]
  double load = 0;                               ///< normal force N [N]
  double static_load = 0;                        ///< N_s: without damping [N]
  double sinkage = 0;                            ///< of the lowest rim point; < 0: above ground [m]
  double v_x = 0, v_y = 0, rim_speed = 0;        ///< as asked of the model (relaxed) [m/s]
  double mobilised = 0;                          ///< m of WheelContact, 0 to 1 [-]
  double f_x = 0, f_y = 0, torque = 0, m_z = 0;  ///< in the contact frame, by Output
  /// Of the model. kAirborne: no ground contact; kInvalid: a number is not finite (also of the
  /// state), an axle or a normal is 0 or so long that its square overflows, or a time step
  /// negative: force and moment are NaN, and the state stays as it was.
  std::uint32_t flags = kAirborne;
};

/// Forces on wheels of one model. One for each thread: it owns the room that solving needs.
///
/// Contact frame: n the ground's normal, x = axle cross n (normalised), y = n cross x; turning the
/// axle round changes nothing. With the wheel's radius r, distance h of its centre from the ground,
/// axle a:
///   sinkage z = r sqrt(1 - (a n)^2) - h,   rim speed = r (angular velocity . axle).
/// Slip. Of the direction of motion u* = (v_x, v_y, r w)/M, M = max(|r w|, hypot(v_x, v_y)), slip
/// is u*_rim - u*_x and tan(slip angle) is u*_y/u*_x. It is followed over travel, exactly for a
/// motion that is constant over the step:
///   du/dt = (u* - u) M/sigma,   so u += (u* - u) (1 - exp(-M dt/sigma)).
/// With u_d = u + (u* - u) min(1, tau M/sigma), tau = 2 zeta_s sqrt(sigma/(kappa g)), kappa the
/// rise of pull over load with slip at slip 0, the answer is m of the model's at u_d, and 1 - m of
/// its answer to a wheel at rest (no force; the static sinkage, between 257 loads), m =
/// max(|u_rim|, hypot(u_x, u_y)) of u_d, at most 1: forces build up from rest with travel, hold a
/// wheel that stands (Dahl's friction, with the damping of LuGre), and reverse through 0. In steady
/// motion m = 1 and u_d = u = u*. A wheel off the ground forgets u.
///
/// Load. N_s solves z = sinkage(N_s) + N_s/k (LoadAtSinkage); damping
///   N = N_s max(0, 1 + 2 zeta dz/dt/sqrt(g z)),   g of the model,
/// is along -dz/dt and never pulls, so applied to the motion that was asked it takes energy;
/// applied a step later it can give some. The model answers at N:
///   force = f_x x + f_y y + N n,   moment = (h f_y) x - torque a + m_z n,
/// for lateral force acts in the plane of the ground (as in the vehicle solver).
///
/// A wheel that all but lies on its side (sine of axle and normal below 0.06) has no contact frame:
/// no force, kExtrapolated.
class GROUSER_PUBLIC WheelContact {
 public:
  /// The model has to outlive it and must not be moved. Throws std::invalid_argument "NAME: got X,
  /// expected Y": also for a model that does not sink and an infinite tyre stiffness.
  explicit WheelContact(const Model& model, const ContactOptions& options = {});
  WheelContact(WheelContact&& other) noexcept;
  WheelContact& operator=(WheelContact&& other) noexcept;
  ~WheelContact();

  const Model& model() const noexcept;
  const ContactOptions& options() const noexcept;

  /// All wheels in a few batches of the model: advances the states and answers. False, having
  /// written nothing, for spans of different sizes. Allocates only where there are more wheels than
  /// in any call before. What a wheel gets does not depend on the others.
  [[nodiscard]] bool Evaluate(std::span<const WheelMotion> wheels, std::span<ContactState> states,
                              std::span<WheelForce> out);
  /// One wheel. A batch is cheaper by the wheel.
  WheelForce Evaluate(const WheelMotion& wheel, ContactState* state);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// The load [N] at which the wheel sinks in by `sinkage` [m], in that motion [m/s]: an N with
/// sinkage(N) + N/k = z, k the tyre's stiffness, to 1e-7 of the radius. It rises with z, also where
/// a fitted sinkage does not rise with the load (there the load jumps): bracketed by two of eight
/// loads, which are asked so that a deeper sinkage never leads to a lower pair, then searched.
/// Proportional to z below Domain::load_min_n, where tables end, and beyond four times
/// Domain::load_max_n (infinite where the wheel does not sink). 0 for z <= 0; NaN for what is not
/// finite. Allocates, and takes some 0.3 ms; a WheelContact does neither.
GROUSER_PUBLIC double LoadAtSinkage(
    const Model& model, double v_x, double v_y, double rim_speed, double sinkage,
    double tyre_stiffness = std::numeric_limits<double>::infinity());

}  // namespace grouser
