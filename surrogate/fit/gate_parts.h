#pragma once

#include <string>
#include <vector>

#include "surrogate/fit/gate.h"
#include "surrogate/fit/training_set.h"
#include "surrogate/models/tabulated_model.h"

namespace grouser::surrogate {

/// What the checks of the gate share.

struct ScanState {
  VelocityState v;
  double load;
};
/// A grid over slip, attack angle and load of a domain, its corners included.
std::vector<ScanState> Scan(const v1alpha1::Domain& domain);
/// 2000 states evenly over the same: an additive recurrence (Roberts 2018).
std::vector<ScanState> Drawn(const v1alpha1::Domain& domain);
WheelAnswer At(const TabulatedModel& model, const VelocityState& v, double load);

/// The largest change of an answer at a state, in half-widths of the base's interval. f_z counts
/// where both models carry the load alone: its interval is how closely a DEM run holds its load,
/// and says nothing of what a soil carries that does not carry all of it (NO_EQUILIBRIUM).
struct Moved {
  double half_widths = 0;
  int output = 0;
};
Moved MovedAt(const WheelAnswer& before, const WheelAnswer& after);

enum class Side { kAtMost, kAtLeast };
/// The result of a check whose number keeps to a limit or not. NaN does not.
GateResult Judged(const std::string& name, double value, Side side, double limit,
                  const std::string& more);

/// What both models are judged by: the runs held out, else those that the base was fitted to.
struct Known {
  std::vector<Sample> rows;
  std::string what;
};
Known KnownRuns(const v1alpha1::Model& base, const v1alpha1::Model& candidate);

/// Of the runs of a row those that the intervals cover.
int CoveredOf(const v1alpha1::ErrorRow& row);
/// Least count of a row's runs that intervals which hold what they promise cover, but for 1 in 40.
int LeastHonest(const v1alpha1::ErrorRow& row);

/// How much wider intervals may be by chance. The width is the 90 % quantile of the errors of n
/// runs left out of their own fits (Calibrate): such a quantile covers Beta(k, n + 1 - k) of fresh
/// runs, k = ceil(0.9 (n + 1)) (Vovk 2012, Proc. Mach. Learn. Res. 25, 475-490); here k is not
/// rounded, so that no run more raises the limit. With q what 97.5 % of them cover at most, and
/// errors normal with quantiles z:
///   z((1 + q)/2) / z((1 + 0.9)/2), 1.22 for 79 runs.
/// Intervals of fewer than 30 runs are no such quantiles: theirs is the limit of 30.
double WidthByChance(int runs);

/// Check interval_width, see GateChecks.
GateResult IntervalWidth(const v1alpha1::Model& base, const Known& known,
                         const TabulatedModel& old_model, const TabulatedModel& new_model,
                         const GateLimits& limits);

}  // namespace grouser::surrogate
