#pragma once

#include <array>
#include <string>
#include <vector>

#include "surrogate/models/accuracy_request.h"

// Whether answers that were given as good enough are: a pair's models as a
// model selector, asked with tolerances at the test states, against full DEM there.

namespace grouser::surrogate {

/// One tolerance over all test states.
struct PromiseRow {
  std::string tolerance;  ///< for people
  AccuracyRequest accuracy;
  int n = 0;                              ///< states
  int met = 0;                            ///< answered without kToleranceUnmet
  std::vector<int> by_model;              ///< of `met`, who answered
  std::array<int, kOutputs> within{};     ///< of `met`, within the tolerance of the DEM mean
  std::array<bool, kOutputs> compared{};  ///< outputs that have a tolerance (f_z left out)
  int all_within = 0;                     ///< of `met`, on all of those at once
};

struct Promise {
  std::vector<std::string> models;  ///< the cheapest first
  std::vector<double> cost_ns;
  std::vector<PromiseRow> rows;
};

struct PromiseOptions {
  /// Costs of bekker, lookup, hybrid; empty: measured now.
  std::vector<double> cost_ns;
  /// Error tables from training alone: the test states then judge a choice that
  /// they had no part in.
  bool without_held_out = false;
};

/// Tolerances: 3, 6, 10, 15, 20 and 30 % of load, load r and r on all outputs,
/// and 2, 4, 8 mm of sinkage alone. folder: runs.json and the three models.
/// Throws std::invalid_argument naming the file that is not there.
Promise MeasurePromise(const std::string& folder, const PromiseOptions& options = {});

/// Counts that keep a promise of 90 % for n states: at least the lower end of
/// the exact 95 % binomial band.
int FewestWithin(int n);

std::string PromiseText(const Promise& promise);
std::string PromiseJson(const Promise& promise);

}  // namespace grouser::surrogate
