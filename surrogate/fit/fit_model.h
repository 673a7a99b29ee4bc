#pragma once

#include <functional>
#include <string>
#include <vector>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/fit/training_set.h"

namespace grouser::surrogate {

using ProgressText = std::function<void(const std::string&)>;

struct FitRequest {
  std::string name;
  v1alpha1::Rung rung = v1alpha1::RUNG_HYBRID;
  TrainingSet set;
  std::string base_digest, command, reason;
  std::vector<v1alpha1::MeasuredPoint> measured;
  ProgressText progress = [](const std::string&) {};
};

/// Fewest steady training runs that a fit accepts.
inline constexpr int kFewestRuns = 6;

/// Runs to model: physics and residual fitted to the steady TRAIN runs,
/// uncertainty from cross-validation and PATCH repeats, domain, error table
/// ("held_out": the steady TEST runs, which nothing else sees), provenance,
/// golden vectors. Throws std::runtime_error saying what is missing.
v1alpha1::Model FitModel(const FitRequest& request);

/// The base model's provenance rows plus one new run. Throws
/// std::runtime_error for a run that is not steady, is known already, or is of
/// another wheel.
FitRequest RefitRequest(const v1alpha1::Model& base, const std::string& base_digest,
                        const std::string& run_file);

}  // namespace grouser::surrogate
