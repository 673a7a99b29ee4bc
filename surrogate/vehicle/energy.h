#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "surrogate/vehicle/solver.h"
#include "surrogate/vehicle/stop.h"

namespace grouser::vehicle {

/// Where the power of a solved motion goes [W]. With T w shaft power, F, M_z forces of the ground
/// in the wheel's axes, V the twist of the vehicle:
///   rolling = (T - r F_x) w     slip = F_x (r w - v_x)     scrub = -(F_y v_y + M_z yaw rate)
///   grade, acceleration: work against gravity and inertia; drive = electric - shaft
/// so that electric = drive + rolling + slip + scrub + grade + acceleration + imbalance, where
/// imbalance is what the solve left over times V.
struct Power {
  double electric = 0, shaft = 0;
  double drive = 0, rolling = 0, slip = 0, scrub = 0, grade = 0, acceleration = 0, imbalance = 0;
  std::array<double, kMostWheels> wheel{};  ///< shaft power by wheel
  double Sum() const { return drive + rolling + slip + scrub + grade + acceleration; }
};
/// Precondition: `solution` is of `motion`.
Power PowerOf(const Vehicle& vehicle, const Motion& motion, const Solution& solution) noexcept;

/// Power at the mean ground and at grounds better and worse by `sds` standard deviations.
struct PowerInterval {
  Power mean;
  double electric_low = 0, electric_high = 0;      ///< both NaN: no balance at one
  double joules_per_metre = 0, low = 0, high = 0;  ///< of way of the centre; NaN turning in place
  double speed_m_per_s = 0;                        ///< of the centre, by SpeedOf
  Solution solution;                               ///< at the mean
};
/// Speed from watts over J/m, which messages carry; `otherwise` where that says nothing: no power,
/// or turning in place.
double SpeedOf(double watts, double joules_per_metre, double otherwise) noexcept;
PowerInterval PowerOf(Solver* solver, const Motion& motion, double sds = 1.6448536269514722);

/// PowerOf of many motions, the same bits: all of a call are solved side by side.
class PowerBatch {
 public:
  static constexpr std::size_t kMost = 21;  ///< motions of a call: with both ends 63 solves
  static constexpr std::size_t kMostMeans = 3 * kMost;  ///< without ends

  /// With room for so many motions a call, at most kMost, and without ends three times as many.
  explicit PowerBatch(Solver* solver, std::size_t most = kMost);
  std::size_t MostAt(double sds) const { return sds == 0 ? asked_.size() : asked_.size() / 3; }
  /// Of n motions: asks for each, next(), and tells of each in the same order, tell(power), a batch
  /// at a time. `sds`, `stop` as of Of. No allocation.
  template <class Next, class Tell>
  void ForEach(std::size_t n, double sds, const StopWhen& stop, const Next& next,
               const Tell& tell) {
    for (std::size_t first = 0; first < n; first += MostAt(sds)) {
      const std::size_t some = std::min(MostAt(sds), n - first);
      for (std::size_t k = 0; k < some; ++k) asked_[k] = next();
      for (const PowerInterval& power : Of(std::span(asked_).first(some), sds, stop)) tell(power);
    }
  }
  /// Valid until the next call; `sds` 0: the ends are the mean, in a third of the time. Throws
  /// as StopIfAsked, after 3 kMost solves at most. Precondition: at most MostAt(sds)
  /// motions.
  std::span<const PowerInterval> Of(std::span<const Motion> motions, double sds,
                                    const StopWhen& stop);

 private:
  Solver* solver_;
  std::vector<Motion> asked_;  // of ForEach
  std::vector<Motion> room_;
  std::vector<Solution> solutions_;
  std::vector<PowerInterval> powers_;
};

/// Electric energy of steady motions that follow one another: sums of power times duration. Ends:
/// of a ground that errs alike all along, in the same direction as in each motion's interval.
struct DriveEnergy {
  double joules = 0, low = 0, high = 0;
  double seconds = 0, metres = 0;  ///< of what is in the sums; way of the centre of gravity
  /// Motions, and the time of them, that are not in the sums, as the ground gives no balance at the
  /// mean or at an end.
  std::size_t left_out = 0;
  double left_out_s = 0;

  void Add(const PowerInterval& power, double duration_s);
};

}  // namespace grouser::vehicle
