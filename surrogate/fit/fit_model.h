#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/fit/bekker_fit.h"
#include "surrogate/fit/training_set.h"

namespace grouser::surrogate {

using ProgressText = std::function<void(const std::string&)>;

struct FitRequest {
  std::string name;
  v1alpha1::ModelKind kind = v1alpha1::MODEL_KIND_HYBRID;
  TrainingSet set;
  std::string base_digest, command, reason;
  std::vector<v1alpha1::MeasuredPoint> measured;
  /// Of stress profiles (BekkerFitOptions); none: ProfileWeightOf(kind).
  std::optional<double> profile_weight;
  ProgressText progress = [](const std::string&) {};
};

/// kProfileWeight for the bekker kind, whose parameters are to mean what they
/// say. 0 for the hybrid: its table takes up what physics leaves of the totals,
/// which profiles only pull away from them.
double ProfileWeightOf(v1alpha1::ModelKind kind);

/// Fewest steady training runs that a fit accepts.
inline constexpr int kFewestRuns = 6;

/// Runs to model: physics and residual fitted to the steady TRAIN runs,
/// uncertainty from cross-validation and PATCH repeats, domain, error table
/// ("held_out": the steady TEST runs, which nothing else sees), provenance,
/// golden vectors. Throws std::runtime_error saying what is missing, and
/// std::invalid_argument naming the first run that cannot be (CheckRuns).
v1alpha1::Model FitModel(const FitRequest& request);

/// The base model's provenance rows plus one new run, plus the training runs of `with`
/// (other refits of the same name) that the base lacks, each once. Throws std::runtime_error for a
/// run that is not steady, is known already, or is of another wheel.
FitRequest RefitRequest(const v1alpha1::Model& base, const std::string& base_digest,
                        const std::string& run_file, const std::vector<v1alpha1::Model>& with = {});

}  // namespace grouser::surrogate
