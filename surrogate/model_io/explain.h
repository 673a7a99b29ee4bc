#pragma once

#include <string>

#include "grouser/v1alpha1/explanation.pb.h"
#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// Runs in each list of an explanation: as a rule, at most.
inline constexpr int kUsualRuns = 5, kMostRuns = 20;

/// A model and what it answers by.
struct ExplainedModel {
  const v1alpha1::Model& message;
  std::string reference;        ///< "NAME@sha256:HEX"
  const WheelModel& evaluator;  ///< of MakeModel, as servers and planners have it
};

/// Why a model answers one state as it does, from its file alone. Flags, outputs and intervals are
/// the evaluator's, bit by bit; each flag that is set has a reason or more. What the file does not
/// hold is said in `notes` and in each run's `no_stress`; nothing is made up for it. A millisecond
/// or two with 235 runs, and below 1 MB however long the strings and arrays of the file are. A
/// wheel at rest, off the ground or with an invalid state has no runs beside it.
///
/// state: exactly one, in either form; else std::invalid_argument naming the array. Its numbers may
/// be any. runs: in each list, 0 to kMostRuns, else std::invalid_argument.
v1alpha1::Explanation Explain(const ExplainedModel& model, const v1alpha1::WheelStates& state,
                              int runs = kUsualRuns);

}  // namespace grouser::surrogate
