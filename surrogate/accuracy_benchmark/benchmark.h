#pragma once

#include <functional>
#include <string>
#include <vector>

#include "surrogate/accuracy_benchmark/errors.h"
#include "surrogate/fit/pair_folder.h"

namespace grouser::surrogate {

/// Fits hybrid, lookup and bekker to the folder's runs and writes the models
/// there, each tested as the server does (WriteTestedModel). `command`: for their
/// provenance; accept_unusual: as ReadMeasured's; progress: a line a file.
void FitPair(const std::string& folder, const std::string& command, bool accept_unusual,
             const std::function<void(const std::string&)>& progress);

/// Rows of a pair, kinds from the cheapest: bekker_untuned, bekker, lookup, hybrid,
/// kriging, coarse_dem, dem, all on the same test states against full DEM, and
/// those of in-process kinds against measurement. Time: models a state of a batch
/// of 10,000, processor time; kriging one at a time; DEM the mean of its runs' own
/// wall times. dem: every repeat of a patch state against the mean of the others,
/// so that its error is what one more run would be wrong by. seconds: spent on
/// the timing of each kind.
std::vector<BenchmarkRow> RunAccuracyBenchmark(const PairFolder& pair, double seconds);

std::string BenchmarkJson(const std::vector<BenchmarkRow>& rows);
std::string BenchmarkText(const std::vector<BenchmarkRow>& rows);
/// Markdown: by pair its targets, a table of region `all` by kind and output, and one
/// by region.
struct Target;
std::string BenchmarkMarkdown(const std::vector<BenchmarkRow>& rows,
                              const std::vector<Target>& targets);

}  // namespace grouser::surrogate
