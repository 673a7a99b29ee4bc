#include "server/query/grpc/answer.h"

#include <chrono>

#include "server/core/accuracy_request.h"
#include "server/core/evaluator.h"

namespace grouser::server {
namespace {

/// Who answered each state, and the run that would help most where it matters.
void Tell(const Selection& selection, v1alpha1::EvaluateWheelsResponse* response) {
  for (const ServedModel* model : selection.selectable->models)
    response->add_selectable_models(model->reference);
  if (selection.worst.excess == 0) return;
  const auto i = static_cast<int>(selection.worst.index);
  const v1alpha1::VelocityForm& v = response->responses().velocity();
  v1alpha1::RefinementHint* hint = response->mutable_refinement();
  hint->set_index(selection.worst.index);
  hint->set_excess(selection.worst.excess);
  hint->set_output(surrogate::kOutputFields[selection.worst.output].name);
  const ServedModel& answered = *selection.selectable->models[response->answered_by(i)];
  hint->set_model(answered.reference);
  *hint->mutable_state() =
      ToTestState(v.v_x_m_per_s(i), v.v_y_m_per_s(i), v.rim_speed_m_per_s(i), selection.worst.load);
  // Elsewhere the speed is the model's own: its answers do not depend on it.
  if (!answered.message.residual().rate_coefficients().empty()) {
    hint->mutable_state()->set_speed_m_per_s(response->responses().slip().speed_m_per_s(i));
  }
}

}  // namespace

Status AnswerFrom(const Snapshot& snapshot, const v1alpha1::EvaluateWheelsRequest& request,
                  v1alpha1::EvaluateWheelsResponse* response, const ServedModel** model) {
  *model = nullptr;
  Selection selection;
  selection.answered_by.Swap(response->mutable_answered_by());  // its memory is reused
  AnswerParts parts{!request.values_only(), request.with_gradients()};
  Status status = parts.fields.Read(request.fields());
  if (status.ok()) {
    status = Evaluate(snapshot, request.model(), request.states(), parts, model,
                      response->mutable_responses(), request.accuracy(), &selection);
  }
  selection.answered_by.Swap(response->mutable_answered_by());
  response->clear_selectable_models();
  response->clear_refinement();
  response->set_sequence(request.sequence());
  response->set_generation(snapshot.generation());
  if (status.ok()) {
    response->set_model((*model)->reference);
    response->clear_error();
    if (selection.selectable) {
      Tell(selection, response);
    } else {
      response->clear_answered_by();
    }
    if (!request.fields().empty()) parts.fields.DropOthers(response->mutable_responses());
  } else {
    response->clear_answered_by();
    response->clear_model();
    response->clear_responses();
    response->mutable_error()->set_code(static_cast<int>(status.code));
    response->mutable_error()->set_message(status.message);
  }
  return status;
}

Status Answer(const QueryPath& path, Transport transport,
              const v1alpha1::EvaluateWheelsRequest& request,
              v1alpha1::EvaluateWheelsResponse* response) {
  const auto start = std::chrono::steady_clock::now();
  const auto snapshot = path.store.Current();
  const ServedModel* model = nullptr;
  const Status status = AnswerFrom(*snapshot, request, response, &model);
  const std::chrono::nanoseconds spent = std::chrono::steady_clock::now() - start;
  if (status.ok()) {
    const auto& flags = response->responses().flags();
    path.metrics.Answered(transport, *model->counters,
                          {flags.data(), static_cast<std::size_t>(flags.size())}, spent);
  } else {
    path.metrics.Refused(transport, status.code);
  }
  response->mutable_latency()->set_seconds(spent.count() / 1'000'000'000);
  response->mutable_latency()->set_nanos(static_cast<int>(spent.count() % 1'000'000'000));
  if (path.log != nullptr && status.ok()) path.log->Offer(transport, request, *response);
  return status;
}

}  // namespace grouser::server
