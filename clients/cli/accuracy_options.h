#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "grouser/v1alpha1/terrain_service.pb.h"

namespace grouser::cli {

/// How good an answer has to be, or how little it may cost, on the command line.
class AccuracyOptions {
 public:
  void AddTo(CLI::App& command);

  /// Sets request.accuracy request where an option was given. Throws CLI::ValidationError
  /// for a tolerance that is not OUTPUT=NUMBER; numbers are the server's to judge.
  void Apply(v1alpha1::EvaluateWheelsRequest* request) const;

 private:
  std::vector<std::string> tolerances_;
  double share_ = 0, budget_us_ = 0;
  std::string against_ = "dem";
};

/// Who answered which state, and where one is unmet the command that orders the
/// DEM run that helps most. `jobs`: address of grouser-jobs; empty: the default.
void PrintAccuracyOutcome(const v1alpha1::EvaluateWheelsResponse& response,
                          const std::string& jobs);

}  // namespace grouser::cli
