#pragma once

#include <string_view>

#include "grouser/v1alpha1/state.pb.h"
#include "server/core/answer_fields.h"
#include "server/core/snapshot.h"
#include "server/core/status.h"
#include "surrogate/models/model_selector.h"

namespace grouser::server {

/// Most states in one message.
inline constexpr int kMaxStates = 10000;

/// With gradients, so that the answer stays below the 4 MB that gRPC's clients take.
inline constexpr int kMaxStatesWithGradients = 5000;

/// What of an answer is wanted.
struct AnswerParts {
  bool uncertainty = true;  ///< sd_fit, sd_patch, sd_form, intervals
  bool gradients = false;   ///< NaN from a model that has none
  /// Outputs of which no part is wanted, and echoes that are not, are left empty. Beside an
  /// accuracy request all are answered: AnswerFields::DropOthers() makes both alike.
  AnswerFields fields = {};
};

/// Checks a message as a whole: kinematics given, 1 to `max_states` states, every array of one
/// length. INVALID_ARGUMENT or RESOURCE_EXHAUSTED naming the field and the lengths. Values of
/// single states are not looked at.
Status ValidateStates(const v1alpha1::WheelStates& states, int max_states = kMaxStates);

/// An accuracy request and the models that may answer it.
struct Selection {
  const SelectableModels* selectable = nullptr;  ///< null: no accuracy request was made
  surrogate::AccuracyRequest accuracy;
  google::protobuf::RepeatedField<std::uint32_t> answered_by;  ///< out: who answered each state
  surrogate::Shortfall worst;                                  ///< out
};

/// Answers a valid message with `model`; both forms of the kinematics are
/// echoed. A state with a bad value gets STATE_FLAG_INVALID and NaN outputs and
/// harms no other. Arrays of `parts` that are not wanted stay empty. Every
/// field of `responses` is overwritten and its memory reused: do not Clear() it
/// between messages, since that frees the arrays. With selectable models in *selection, its
/// they answer as the accuracy request has it; `model` then gives the training speed and
/// the averaging length.
/// Precondition: ValidateStates(states).ok().
void EvaluateStates(const ServedModel& model, const v1alpha1::WheelStates& states,
                    AnswerParts parts, v1alpha1::WheelResponses* responses,
                    Selection* selection = nullptr);

/// The same, without a selection, on plain spans (adapters without protobuf messages): evaluates,
/// writes what `form` has room for and marks STATE_FLAG_FORM_UNKNOWN where the model was not
/// compared with a measurement. Precondition: as of surrogate::AddForm.
void EvaluateViews(const ServedModel& model, const surrogate::WheelStatesView& in,
                   const surrogate::ResponsesView& out, const surrogate::FormView& form = {});

/// Resolve, validate, evaluate. On failure `responses` is left empty. An empty
/// accuracy request is none: *selection (which may be null then) has no selectable.
Status Evaluate(
    const Snapshot& snapshot, std::string_view model_reference, const v1alpha1::WheelStates& states,
    AnswerParts parts, const ServedModel** answered_by, v1alpha1::WheelResponses* responses,
    const v1alpha1::AccuracyRequest& accuracy = v1alpha1::AccuracyRequest::default_instance(),
    Selection* selection = nullptr);

}  // namespace grouser::server
