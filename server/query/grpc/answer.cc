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

Status Answer(const SnapshotStore& store, const v1alpha1::EvaluateWheelsRequest& request,
              v1alpha1::EvaluateWheelsResponse* response) {
  const auto start = std::chrono::steady_clock::now();
  const auto snapshot = store.Current();
  const ServedModel* model = nullptr;
  Selection selection;
  selection.answered_by.Swap(response->mutable_answered_by());  // its memory is reused
  Status status = Evaluate(*snapshot, request.model(), request.states(), request.values_only(),
                           &model, response->mutable_responses(), request.accuracy(), &selection);
  selection.answered_by.Swap(response->mutable_answered_by());
  response->clear_selectable_models();
  response->clear_refinement();
  response->set_sequence(request.sequence());
  response->set_generation(snapshot->generation());
  if (status.ok()) {
    response->set_model(model->reference);
    response->clear_error();
    if (selection.selectable) {
      Tell(selection, response);
    } else {
      response->clear_answered_by();
    }
  } else {
    response->clear_answered_by();
    response->clear_model();
    response->clear_responses();
    response->mutable_error()->set_code(static_cast<int>(status.code));
    response->mutable_error()->set_message(status.message);
  }
  const std::chrono::duration<double, std::micro> spent = std::chrono::steady_clock::now() - start;
  response->set_latency_us(spent.count());
  return status;
}

void DescribeModels(const SnapshotStore& store, v1alpha1::ListModelsResponse* response) {
  const auto snapshot = store.Current();
  response->set_generation(snapshot->generation());
  for (const auto& model : snapshot->models()) {
    const auto& message = model->message;
    auto* info = response->add_models();
    info->set_name(message.name());
    info->set_digest(model->digest);
    if (const auto it = snapshot->aliases().find(message.name()); it != snapshot->aliases().end()) {
      for (const auto& [alias, target] : it->second) {
        if (target == model) info->add_aliases(alias);
      }
    }
    *info->mutable_domain() = message.domain();
    *info->mutable_errors() = message.errors();
    *info->mutable_provenance() = message.provenance();
    info->set_radius_m(message.wheel().radius_m());
    info->set_width_m(message.wheel().width_m());
    info->set_soil(message.soil().name());
    info->set_shipped(model->shipped);
  }
}

}  // namespace grouser::server
