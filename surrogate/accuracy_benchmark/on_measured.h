#pragma once

#include <functional>
#include <string>
#include <vector>

#include "surrogate/accuracy_benchmark/errors.h"
#include "surrogate/accuracy_benchmark/timing.h"
#include "surrogate/fit/measured.h"

// Answers and DEM runs beside the measured wheel.

namespace grouser::surrogate {

/// A kind that answers any state, at the measured ones; speed: max(|r w|, V) [m/s].
std::vector<Compared> OnMeasured(const std::vector<v1alpha1::MeasuredPoint>& points, double speed,
                                 const std::function<Answer(const Sample&)>& answer);

/// DEM runs at measured states. Half widths are 0: a run has no interval for a measurement.
struct DemOnMeasured {
  std::string kind;  ///< of ReadValidated: "dem 8 mm"
  std::vector<Compared> compared;
  double wall_s = 0;  ///< mean of a run, its own wall time; NaN: told of none
};
/// The runs that were made at the states (DistanceOf at most 0.1: as campaigns round them), states
/// without one left out; runs that are steady or drifted to their end.
DemOnMeasured RunsAtStates(const std::vector<v1alpha1::MeasuredPoint>& points,
                           const std::vector<v1alpha1::RunSummary>& runs);

/// measured_dem*.json of a pair's folder, by name.
std::vector<std::string> ValidatedFiles(const std::string& folder);
/// Such a file: rows.json of `grouser validate`, whose means over beds stand at the states
/// themselves. Throws std::invalid_argument "FILE: ..." where it is none.
DemOnMeasured ReadValidated(const std::string& path);

}  // namespace grouser::surrogate
