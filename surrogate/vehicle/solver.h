#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "surrogate/models/draw_field.h"
#include "surrogate/models/mixture_model.h"
#include "surrogate/models/wheel_model.h"
#include "surrogate/vehicle/vehicle.h"

namespace grouser::vehicle {

inline constexpr std::size_t kMostSoils = 255;  ///< of a vehicle's grounds: a byte each

/// A soil that a mixture may be, and how likely that is.
struct SoilShare {
  std::size_t soil = 0;  ///< index in the same grounds
  double weight = 0;     ///< above 0
};

/// Which model answers for a wheel type on a soil.
struct Grounds {
  std::vector<std::string> soils;
  /// At type * soils + soil; null: that wheel has no model of that soil. Not owned.
  std::vector<const surrogate::WheelModel*> models;
  /// At soil: the soils of a mixture (mixture_ground.h), in the order of its models' parts and with
  /// their weights, sum 1. Empty, or beyond the end: no mixture.
  std::vector<std::vector<SoilShare>> shares{};

  const surrogate::WheelModel* At(std::size_t type, std::size_t soil) const {
    return models[type * soils.size() + soil];
  }
};

/// Coherent draws of every soil of some grounds, by its name (surrogate/models/draw_field.h). Draw
/// k of a mixture is draw k of one of its soils, chosen by a number of the mixture's name and k.
struct GroundDraws {
  /// Throws std::invalid_argument as surrogate::Draws.
  GroundDraws(const Grounds& grounds, std::size_t count) {
    for (const std::string& soil : grounds.soils) of_soil.emplace_back(soil, count);
  }
  std::size_t count() const { return of_soil.front().size(); }
  /// The soil whose draw k is that of `soil`, of the same grounds: itself where it is no mixture.
  std::size_t SoilOf(const Grounds& grounds, std::size_t soil, std::size_t k) const noexcept {
    if (soil >= grounds.shares.size() || grounds.shares[soil].empty()) return soil;
    const std::span<const SoilShare> shares = grounds.shares[soil];
    return surrogate::PartAt(shares, of_soil[soil][k].which).soil;
  }

  std::vector<surrogate::Draws> of_soil;
};

/// A steady motion to be solved: all but lateral velocity and controls, or the controls.
struct Motion {
  enum class Given : std::uint8_t {
    kTwist,    ///< v_x and yaw rate: rim speeds and steering are found
    kControls  ///< rim speeds and steering: v_x, v_y and yaw rate are found
  };
  Given given = Given::kTwist;
  double v_x_m_per_s = 0;                               ///< kTwist: of the origin, forward
  double yaw_rate_rad_per_s = 0;                        ///< kTwist: to the left
  std::array<double, kMostDrives> rim_speed_m_per_s{};  ///< kControls: r w by drive
  double steering_rad = 0;                              ///< kControls: psi of Steering
  double acceleration_m_per_s2 = 0;                     ///< rate of v_x
  double yaw_acceleration_rad_per_s2 = 0;
  double grade_rad = 0;  ///< the ground rises ahead (pitch of ISO 8855 is its negative)
  double bank_rad = 0;   ///< the ground rises to the left (roll of ISO 8855)
  /// Ground worse than the models' mean by so many standard deviations, at all wheels at once:
  /// less gross traction and lateral force, more torque. 1.645: as bad as one time in twenty.
  double worse_by_sd = 0;
  /// Ground of that draw of the solver's (Solver::UseDraws), at all wheels, each by its soil.
  int draw = kMeanGround;
  static constexpr int kMeanGround = -1;
  std::array<std::uint8_t, kMostWheels> soil{};  ///< index of the soil under each wheel

  /// A point of a path: curvature = yaw rate over v_x, to the left.
  static Motion OnPath(double speed, double curvature) {
    Motion motion;
    motion.v_x_m_per_s = speed;
    motion.yaw_rate_rad_per_s = speed * curvature;
    return motion;
  }
};

/// Why a solution is none, or is none to rely on. Bits.
enum Reason : std::uint32_t {
  kNoBalance = 1,   ///< no controls balance forces and moments on this ground
  kOverTorque = 2,  ///< a motor's torque, current, voltage or power, or the steering, is exceeded
  kSinksIn = 4,     ///< a wheel sinks deeper than the limit, or the soil carries it nowhere
  kTips = 8,        ///< gravity and inertia meet the ground outside the wheels
  kUntrainedSpeed = 16,  ///< faster than the model's runs: no limit of the ground
  kModelDomain = 32,     ///< outside what the model's runs covered: no limit of the ground
  kBadInput = 64  ///< the motion is not finite, a wheel has no model of its soil, no such draw
};
inline constexpr std::uint32_t kLimits = kNoBalance | kOverTorque | kSinksIn | kTips;
inline constexpr std::uint32_t kUntrained = kUntrainedSpeed | kModelDomain;
/// "BALANCE", ... joined by '|'; "" for none.
std::string NamesOf(std::uint32_t reasons);

/// One wheel of a solution; forces and slip in the wheel's own axes.
struct WheelSolution {
  double load_n, rim_speed_m_per_s, v_x_m_per_s, v_y_m_per_s;
  double slip, slip_angle_rad, steer_rad;  ///< steer: from the vehicle's x
  double f_x_n, f_y_n, torque_n_m, m_z_n_m, sinkage_m;
  double shaft_power_w;  ///< torque times spin
  std::uint32_t flags;   ///< of the model
};

struct Solution {
  std::uint32_t reasons = 0;  ///< bits of Reason; 0: solved, within every limit
  bool balanced = false;      ///< residual <= kTolerance
  double residual = 0;        ///< largest imbalance, over weight (and weight times length)
  int evaluations = 0;        ///< of the wheels
  double v_x_m_per_s = 0, v_y_m_per_s = 0, yaw_rate_rad_per_s = 0;  ///< of the origin
  double side_slip_rad = 0;  ///< atan2(v_y, v_x) of the centre of gravity
  double steering_rad = 0;
  std::array<double, kMostDrives> rim_speed_m_per_s{};  ///< r w by drive
  double pitching_moment_n_m = 0;            ///< of the wheels: sum of (r - sinkage) f_x - torque
  double f_x_n = 0, f_y_n = 0, m_z_n_m = 0;  ///< of the ground on the vehicle, at the origin
  double shaft_power_w = 0, electric_power_w = 0;
  double tip_margin = 0;      ///< see Loads
  double torque_margin = 0;   ///< 1 - largest use of a motor's limit or of the steering
  double sinkage_margin = 0;  ///< 1 - largest sinkage over its limit
  /// 1 - the largest of max(|r w|, V) over what the runs of the wheel's model cover; wheels in the
  /// air do not count.
  double speed_margin = 1;
  std::array<WheelSolution, kMostWheels> wheel;  ///< as many as the vehicle has
  /// What intervals add to the gradients of up to eight unknowns, for the next warm search of a
  /// motion of which the same is given.
  Motion::Given given = Motion::Given::kTwist;
  std::array<std::array<float, 8>, 8> interval_slope{};

  static constexpr double kTolerance = 1e-6;
};

/// How hard a solve tries before it says that nothing balances.
struct Effort {
  /// Balanced solutions that stand in `out`, of the same motions or of similar ones, are where the
  /// search begins.
  bool warm = false;
  int attempts = 4;      ///< starts, the warm one among them; there are four others
  int evaluations = 40;  ///< of the wheels, most for a start
  double goal = 1e-7;    ///< imbalance at which the search ends, at most Solution::kTolerance
  /// Angles and slips are not asked for: side_slip_rad and slip, slip_angle_rad,
  /// steer_rad of the wheels are NaN.
  bool brief = false;
  /// With `warm`: solutions that did not balance, too, from where their imbalance is least.
  bool from_least = false;
  /// Of motions that no start balances, from motions beside that are: on ground that gets worse
  /// from the mean, in a curve that gets tighter from straight on, and in both at once.
  bool follows = false;
};

/// Motions that come one by one, as what is asked next depends on what was found.
class SolveSource {
 public:
  struct Task {
    const Motion* motion;  ///< both stay where they are until Done
    Solution* solution;    ///< with effort.warm, where the search begins
    Effort effort;
  };
  /// What a lane, which is free, solves next; false: nothing now. Asked again after each Done.
  virtual bool Next(std::size_t lane, Task* task) = 0;
  /// The lane's solution is written. May throw, which ends the solve.
  virtual void Done(std::size_t lane) = 0;

 protected:
  ~SolveSource() = default;
};

/// Finds the quasi-static motion of a vehicle whose wheels answer by models. Unknown: v_y and two
/// controls (or v_x, v_y, yaw rate), the pitching moment of the wheels, the speeds of wheels that
/// roll freely or behind a differential. With wheel forces F in the vehicle's axes, loads by
/// Support and accelerations of the centre of gravity G at constant v_y,
///   a = (v' - w (v_y + w x_G) - w' y_G, w (v_x - w y_G) + w' x_G):
///   sum F_x = m (a_x + g sin(grade)),  sum F_y = m (a_y + g cos(grade) sin(bank)),
///   sum (x F_y - y F_x + M_z) = x_G F_y - y_G F_x + I_z w',
///   sum x N = x_G N - z_G F_x + sum cos(steer) ((r - sinkage) F_x - T),
///   sum y N = y_G N - z_G F_y,   N = m g cos(grade) cos(bank).
/// Newton with the models' gradients, steps bounded and halved, then damped (Levenberg); many
/// motions advance together, so that the wheels of all are one batch of each model.
///
/// At rest (v_x = yaw rate = 0) the answer is the limit of creeping forward, speeds and powers 0.
/// Not modelled: pitching and rolling motion, gyroscopic moments, drag of air, ruts of the wheels
/// ahead (every wheel meets virgin ground).
class Solver {
 public:
  static constexpr std::size_t kLanes = 16;  ///< motions that advance together

  /// Throws std::invalid_argument: Check(vehicle), and grounds that have no model at all or
  /// whose table has another size. Models must outlive the solver.
  Solver(const Vehicle& vehicle, const Grounds& grounds);
  ~Solver();
  Solver(Solver&&) noexcept;

  /// From now on motions may name a draw of these, which are of the same grounds; null: none.
  /// Throws std::invalid_argument for draws of another number of soils, and nothing for none.
  void UseDraws(std::shared_ptr<const GroundDraws> draws);

  /// Solves all motions; no allocation, lock or system call. Not from two threads at once.
  /// Precondition: as many solutions as motions.
  void Solve(std::span<const Motion> motions, std::span<Solution> out, Effort effort) noexcept;
  void Solve(std::span<const Motion> motions, std::span<Solution> out, bool warm = false) noexcept {
    Solve(motions, out, Effort{.warm = warm, .follows = true});
  }

  /// What Effort::follows does to one motion that was solved; one that balances stays as it is.
  void Follow(const Motion& motion, Solution* out) noexcept;

  /// The same for motions of kTwist that come one by one: each of kLanes lanes is asked for its
  /// next as soon as its last is done. What a lane finds does not depend on the others.
  void Solve(SolveSource* source);

  const Vehicle& vehicle() const;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace grouser::vehicle
