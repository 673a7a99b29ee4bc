#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "surrogate/vehicle/energy.h"

namespace grouser::vehicle {

/// Durations above it are refused where trajectories and drives are read, so that sums stay finite.
inline constexpr double kLongestStepS = 1e9;

/// A steady motion and how long it lasts.
struct TrajectoryStep {
  Motion motion;
  double duration_s = 0;  ///< above 0, at most kLongestStepS
};

/// What a trajectory costs: sums and least values over its steps, each solved by itself as PowerOf
/// does. Margins and reasons are those at the mean ground (of the motions' worse_by_sd).
struct TrajectoryCost {
  double duration_s = 0;  ///< of all steps
  DriveEnergy energy;     ///< of the steps that have a power with both ends
  /// Reasons (bits of Reason) of all steps together, and of the first step that has any; -1: none.
  std::uint32_t reasons = 0, first_reasons = 0;
  int first_step = -1;
  /// Least of tip, torque and sinkage margin over the steps that balance, which it is (kTips,
  /// kOverTorque, kSinksIn; the first of equal ones) and where. NaN, 0, -1: no step balances.
  double least_margin = std::numeric_limits<double>::quiet_NaN();
  std::uint32_t least_margin_of = 0;
  int least_margin_step = -1;

  /// Adds its next step, of this number.
  void Add(int step, double duration_s, const PowerInterval& power);
  /// The same of its next step's cost as a trajectory of its own: the same bits.
  void Add(int step, const TrajectoryCost& alone);
};

/// Costs of trajectories by one solver, whose motions are solved side by side, also those of
/// different trajectories.
class TrajectoryEvaluator {
 public:
  /// The next step, those of the first trajectory first.
  using Next = std::function<TrajectoryStep()>;
  /// Told of each step's power, in the same order.
  using Tell = std::function<void(const PowerInterval& power)>;

  explicit TrajectoryEvaluator(Solver* solver) : powers_(solver) {}

  /// Costs of trajectories with so many steps each; `sds`: standard deviations of the ground to
  /// both ends of the energies, 0: none, in a third of the time. Throws as StopIfAsked, at most
  /// 64 solves later.
  std::vector<TrajectoryCost> CostsOf(std::span<const std::size_t> steps, const Next& next,
                                      double sds, const StopWhen& stop = {}, const Tell& tell = {});

 private:
  PowerBatch powers_;
};

}  // namespace grouser::vehicle
