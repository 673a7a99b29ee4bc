#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "surrogate/models/wheel_model.h"
#include "surrogate/vehicle/solver.h"
#include "surrogate/vehicle/support.h"

namespace grouser::vehicle {

inline constexpr std::size_t kMostUnknowns = 4 + kMostWheels;
using Column = std::array<double, kMostUnknowns>;

/// Where the unknowns stand in a vector; -1: given.
struct Layout {
  int v_x = -1, v_y = 0, yaw = -1, psi = -1, moment = 3;
  std::array<int, kMostDrives> drive;
  std::array<int, kMostWheels> rim;  ///< of wheels with a speed of their own
  std::size_t size = 4;
};

/// Four outputs of a wheel (f_x, f_y, torque, m_z), or the first four rows of the imbalance.
typedef double Four __attribute__((vector_size(4 * sizeof(double))));

/// A wheel's state at some unknowns, and how it changes with them. What is not listed follows from
/// these (AddChain) or is 0.
struct Placed {
  double v_x, v_y, rim, load, yaw_rate;
  double cos, sin;     ///< of the steer angle from the vehicle's x
  double steer_slope;  ///< of that angle, by psi
  double rim_by_psi;
  double rim_by_own;  ///< by the unknown that is its rim speed or that of its drive
  int own;            ///< where that stands; -1: given
  double load_by_v_x, load_by_v_y, load_by_yaw, load_by_moment;
};

/// What a model said to it: value and derivatives by v_x, v_y, rim speed and load.
struct Felt {
  std::array<Four, 5> part;
  double sinkage;
  std::uint32_t flags;

  double f_x() const { return part[0][0]; }
  double f_y() const { return part[0][1]; }
  double torque() const { return part[0][2]; }
  double m_z() const { return part[0][3]; }
};

/// One motion on its way to balance.
struct Lane {
  enum class Phase { kIdle, kSearch, kWrite };
  Phase phase = Phase::kIdle;
  const Motion* motion = nullptr;
  Solution* solution = nullptr;
  const Layout* layout = nullptr;
  double scale = 1;                     ///< speeds of the motion over those that are solved (creep)
  double v_x = 0, yaw = 0;              ///< as solved, where given
  double speed = 0;                     ///< unit of speed [m/s]
  double load = 0;                      ///< of all wheels [N]
  double gravity_x = 0, gravity_y = 0;  ///< what gravity asks of the ground [m/s^2]
  Column at{}, last{}, step{}, unit{};  ///< unknowns: tried, accepted, and their units
  Column residual{};                    ///< at `last`, scaled
  std::array<Column, kMostUnknowns> jacobian{};  ///< at `last`, scaled
  /// What the models' gradients leave out (those of their intervals), from the steps of this
  /// attempt.
  std::array<Column, kMostUnknowns> gradients{}, missing{};
  Column best{}, best_residual{};  ///< of all attempts
  double merit = 0, best_merit = 0, share = 1, damping = 0, growth = 4;
  int evaluations = 0, attempt = 0, halvings = 0, stalls = 0;
  bool first = true, warm = false;  ///< warm: the first attempt began at a solution
  double tip_margin = 0;
  double f_x = 0, f_y = 0, m_z = 0;  ///< that gravity and inertia ask for, at `at`
  std::array<Placed, kMostWheels> placed;
  std::array<std::uint32_t, kMostWheels> model{};  ///< that answers for each wheel, by number
};

/// The mechanics of one vehicle: unknowns to wheel states, answers of wheels to imbalance.
class Mechanics {
 public:
  explicit Mechanics(const Vehicle& vehicle);

  const Vehicle& vehicle() const { return vehicle_; }
  const Layout& layout(Motion::Given given) const {
    return layouts_[given == Motion::Given::kTwist ? 0 : 1];
  }
  std::size_t wheels() const { return vehicle_.wheels.size(); }
  double length() const { return length_; }
  double radius(std::size_t wheel) const { return radius_[wheel]; }

  /// Sets units, loads and speeds of a motion; false: not finite.
  bool Begin(Lane* lane) const noexcept;
  /// A first guess of the unknowns; a different one for each attempt.
  void Guess(Lane* lane) const noexcept;
  /// Unknowns of a solution of such a motion, also of one that did not balance; false: it is none
  /// to begin from.
  bool Recall(const Solution& from, bool unbalanced, Lane* lane) const noexcept;
  /// Wheel states at lane->at.
  void Place(Lane* lane) const noexcept;
  /// Imbalance at lane->at, scaled; where `jacobian` is not null also its derivatives by scaled
  /// unknowns.
  void Imbalance(const Lane& lane, std::span<const Felt> felt, Column* residual,
                 std::array<Column, kMostUnknowns>* jacobian) const noexcept;
  /// All of a solution but reasons that need more than the wheels; see Effort::brief.
  void Write(const Lane& lane, std::span<const Felt> felt, bool brief) const noexcept;

 private:
  struct Twist {
    double v_x, v_y, yaw, psi;
    double cos = 1, sin = 0;  // of psi, of steered vehicles
  };
  Twist TwistOf(const Lane& lane) const noexcept;
  double AlongWheel(const Twist& twist, std::size_t i) const noexcept;
  double DriveSpeed(const Lane& lane, std::size_t drive) const noexcept;
  void PlaceLoads(const Twist& twist, Lane* lane) const noexcept;
  void PlaceWheel(const Twist& twist, std::size_t i, Lane* lane) const noexcept;
  void FreeRows(const Lane& lane, std::span<const Felt> felt, Column* residual,
                std::array<Column, kMostUnknowns>* jacobian) const noexcept;
  void WriteDrives(Solution* solution) const noexcept;
  void AddInertia(const Lane& lane, Four* columns) const noexcept;
  double Command(std::size_t drive, double v_x, double yaw) const noexcept;

  Vehicle vehicle_;
  Support support_;
  double length_ = 0, mean_radius_ = 0, weight_ = 0, middle_x_ = 0;
  bool steered_;
  Four per_{};  ///< 1 over the units of the first four rows
  std::array<double, kMostWheels> radius_{};
  std::array<Layout, 2> layouts_;
  std::array<std::size_t, kMostDrives> first_{};  ///< wheel of each drive
};

}  // namespace grouser::vehicle
