#pragma once

#include <map>
#include <string>
#include <vector>

#include "surrogate/accuracy_benchmark/errors.h"

namespace grouser::surrogate {

/// What the accuracy benchmark of a pair should reach, beside what it does.
struct Target {
  std::string pair, what;
  double value, target, moonshot;  ///< NaN moonshot: there is none
  bool at_least;                   ///< value >= target is met, else value <= target
  bool Met() const { return Reached(target); }
  bool Moonshot() const { return Reached(moonshot); }
  bool Reached(double limit) const { return at_least ? value >= limit : value <= limit; }
};

/// Coverage of intervals that were calibrated without the run, from a model's error
/// table, with the number of runs, by output.
struct CrossConformal {
  std::map<std::string, double> share;
  int n = 0;
};

/// The targets of speed and error, in the order of the rows: error over patch noise,
/// R^2 over all states and over the core, 95th percentile over the load by region (of
/// forces and moments), coverage (1: inside the binomial band), cross-conformal
/// coverage over training runs and test states together, width, time an answer.
/// hybrid: the default kind's cross-conformal table; empty: left out.
std::vector<Target> TargetsOf(const std::vector<BenchmarkRow>& rows, const std::string& pair,
                              const CrossConformal& hybrid);

/// The same of a pair's folder, whose hybrid.model has the cross-conformal rows.
struct PairFolder;
std::vector<Target> TargetsOf(const std::vector<BenchmarkRow>& rows, const PairFolder& pair);

std::string TargetsText(const std::vector<Target>& targets);
std::string TargetsMarkdown(const std::vector<Target>& targets);

}  // namespace grouser::surrogate
