#pragma once

#include <functional>
#include <optional>
#include <string>

#include "dem_offline/scenes/experiment_yaml.h"
#include "proto/records/run_file.h"

namespace grouser::campaign {

/// Whether the run goes on; the fraction of the whole [0, 1].
using ToldFn = std::function<bool(double fraction)>;

/// What becomes of physics that fail before the program begins, and of a solid fraction that cannot
/// be reached: an exception, or a record that is FAILED.
enum class OnFailure { kThrow, kRecord };

struct RunOptions {
  dem::WorkLimits limits;
  ToldFn told;
  OnFailure on_failure = OnFailure::kThrow;
  bool resume = false;  ///< from the checkpoint, where there is one
};

/// Runs an experiment: writes the run file `out` (*.run.h5), and beside it OUT.series.csv and a CSV
/// for each table, and frames and checkpoints where it asks for them. Nothing: stopped by `told`;
/// then the CSVs hold what there was. Throws as RunExperiment, InputError for a checkpoint of
/// another run, and std::runtime_error for a file that cannot be written.
std::optional<records::RunFile> RunExperimentTo(const std::string& out,
                                                const ExperimentFile& experiment,
                                                const RunOptions& options);

/// Where the checkpoint of a run stands; it is removed when the run has ended.
std::string CheckpointOf(const std::string& out);

/// Equal for equal experiments and engines: of all values, and other files.
std::string RunIdOf(const ExperimentFile& file);

/// OUT without .run.h5: what the names of the files beside it begin with.
std::string StemOf(const std::string& out);

}  // namespace grouser::campaign
