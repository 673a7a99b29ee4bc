#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "surrogate/models/wheel_model.h"
#include "surrogate/vehicle/pack.h"
#include "surrogate/vehicle/solver.h"
#include "surrogate/vehicle/support.h"

namespace grouser::vehicle {

inline constexpr std::size_t kMostUnknowns = 4 + kMostWheels;
static_assert(kMostUnknowns == pack::kUnknowns && kMostWheels == pack::kWheels &&
              kMostDrives == pack::kDrives);
using Column = std::array<double, kMostUnknowns>;

/// Where the unknowns stand in a vector; -1: given.
struct Layout {
  int v_x = -1, v_y = 0, yaw = -1, psi = -1, moment = 3;
  std::array<int, kMostDrives> drive;
  std::array<int, kMostWheels> rim;  ///< of wheels with a speed of their own
  std::size_t size = 4;
};

/// Where a wheel is: its motion along and across its heading, and that heading.
struct WheelState {
  double v_x, v_y, rim, load;
  double cos, sin;  ///< of the steer angle from the vehicle's x
};

/// What a model said to it.
struct WheelAnswers {
  double f_x, f_y, torque, m_z, sinkage;
  std::uint32_t flags;
};

/// One motion on its way to balance: what each lane decides by itself. Numbers that all lanes work
/// on together: pack::Lanes.
struct Lane {
  enum class Phase { kIdle, kSearch, kWrite };
  Phase phase = Phase::kIdle;
  const Motion* motion = nullptr;
  Solution* solution = nullptr;
  const Layout* layout = nullptr;
  Effort effort;
  double scale = 1;                     ///< speeds of the motion over those that are solved (creep)
  double v_x = 0, yaw = 0;              ///< as solved, where given
  double speed = 0;                     ///< unit of speed [m/s]
  double load = 0;                      ///< of all wheels [N]
  double gravity_x = 0, gravity_y = 0;  ///< what gravity asks of the ground [m/s^2]
  Column at{}, unit{};                  ///< unknowns where an attempt begins; their units
  Column best{};                        ///< of all attempts
  /// Of the imbalance at the accepted point, and at the best one: sum of squares, largest entry.
  double merit = 0, best_merit = 0, largest = 0, best_largest = 0;
  double damping = 0, growth = 4;
  int evaluations = 0, attempt = 0, halvings = 0, stalls = 0;
  bool first = true, warm = false;                 ///< warm: the first attempt began at a solution
  std::array<std::uint32_t, kMostWheels> model{};  ///< that answers for each wheel, by number
  std::array<std::uint8_t, kMostWheels> soil{};    ///< under each wheel; on a draw no mixture
};

/// A lane at its end.
struct Outcome {
  const Lane* lane;
  Column at;
  double tip_margin;
  std::array<WheelState, kMostWheels> wheel;
  std::array<WheelAnswers, kMostWheels> felt;
};

/// The mechanics of one vehicle: motions to unknowns, unknowns and answers to solutions. From
/// unknowns to wheel states and from answers to the imbalance: the kernels of pack.h.
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

  /// What is given for a solve: at rest, that the twist is none.
  Motion::Given GivenOf(const Motion& motion) const noexcept;
  /// Sets units, loads and speeds of a motion; false: not finite.
  bool Begin(Lane* lane) const noexcept;
  /// A first guess of the unknowns; a different one for each attempt.
  void Guess(Lane* lane) const noexcept;
  /// Unknowns of a solution of such a motion, also of one that did not balance; false: it is none
  /// to begin from.
  bool Recall(const Solution& from, bool unbalanced, Lane* lane) const noexcept;
  /// All of a solution but reasons that need more than the wheels; see Effort::brief.
  void Write(const Outcome& outcome, Solution* solution) const noexcept;

  const Support& support() const { return support_; }
  /// The vehicle and its unknowns as the kernels read them.
  pack::Body Body() const noexcept;
  static pack::Unknowns UnknownsOf(const Layout& layout) noexcept;

 private:
  struct Twist {
    double v_x, v_y, yaw, psi;
    double cos = 1, sin = 0;  // of psi, of steered vehicles
  };
  Twist TwistOf(const Lane& lane, const Column& at) const noexcept;
  double AlongWheel(const Twist& twist, std::size_t i) const noexcept;
  void WriteDrives(Solution* solution) const noexcept;
  double Command(std::size_t drive, double v_x, double yaw) const noexcept;

  Vehicle vehicle_;
  Support support_;
  double length_ = 0, mean_radius_ = 0, weight_ = 0, middle_x_ = 0;
  bool steered_;
  std::array<double, 4> per_{};  ///< 1 over the units of the first four rows
  std::array<double, kMostWheels> radius_{};
  std::array<Layout, 2> layouts_;
  std::array<std::size_t, kMostDrives> first_{};  ///< wheel of each drive
};

}  // namespace grouser::vehicle
