#pragma once

#include <string>
#include <vector>

#include "surrogate/fit/print.h"

namespace grouser::surrogate {

/// A model beside a measured wheel: what `grouser-fit compare` is asked.
struct CompareRequest {
  std::string model, measured;        ///< files
  std::vector<std::string> run_dirs;  ///< campaigns; empty: the model's own runs
  bool accept_unusual = false;        ///< as ReadMeasured's
  bool leave_angles_out = false;      ///< adds that check
  bool with_form = false;             ///< wants the model with sd_form
  std::string command;                ///< for its provenance
};
struct MeasuredComparison {
  std::string text, json;
  std::vector<std::string> notes;  ///< of campaigns
  v1alpha1::Model with_form;       ///< with these measured points, and sd_form from them
};
/// Throws as ReadModel, ReadMeasured and ReadRuns do.
MeasuredComparison CompareMeasured(const CompareRequest& asked);

/// Wheel states by slip and attack angle. Throws std::invalid_argument naming the option where
/// there are not as many of both, or for a slip that no motion has.
std::vector<Query> StatesOf(const std::vector<double>& slips,
                            const std::vector<double>& angles_deg);

}  // namespace grouser::surrogate
