#pragma once

#include <array>
#include <string>
#include <vector>

#include "surrogate/fit/calibration.h"
#include "surrogate/fit/pair_folder.h"

namespace grouser::surrogate {

/// What models were off by at the pairs' test states against full DEM, over OutputScale: rows of
/// load 1 and radius 1, `fold` the pair's index. Moves, is not copied: rows point to samples.
struct PairErrors {
  PairErrors() = default;
  PairErrors(PairErrors&&) = default;
  PairErrors& operator=(PairErrors&&) = default;

  std::vector<std::string> pairs;
  std::vector<Sample> samples;
  std::vector<LeftOut> rows;
  double froude_max = 0;  ///< largest v^2/(g r) of the test runs
};

/// Of untuned models (those pairs that name a soil), or of the fitted `bekker` kind. Throws
/// std::invalid_argument where no pair has one.
PairErrors ErrorsOfUntuned(const std::vector<PairFolder>& pairs);
PairErrors ErrorsOfFitted(const std::vector<PairFolder>& pairs);

/// Parameters of the pairs' fitted `bekker` kinds.
std::vector<BekkerParameters> FittedParameters(const std::vector<PairFolder>& pairs);

/// Spread of such errors e over OutputScale:
///
///   |e| <= factor inside (1 + bulldozing P)  in 90 of 100 rows, inside^2 the mean square of
///   e/(1 + bulldozing P), P the share of the motion that bulldozes (Hull::Bulldozing).
///
/// other_pairs: share of a pair's rows inside what the other pairs alone give.
struct ErrorSpread {
  std::array<double, kOutputs> inside{}, bulldozing{}, factor{}, other_pairs{};
};
ErrorSpread SpreadOf(const PairErrors& errors);

}  // namespace grouser::surrogate
