#include "server/query/grpc/answer.h"

#include <chrono>

#include "server/core/evaluator.h"

namespace grouser::server {

QueryStatus Answer(const SnapshotStore& store, const v1alpha1::EvaluateWheelsRequest& request,
                   v1alpha1::EvaluateWheelsResponse* response) {
  const auto start = std::chrono::steady_clock::now();
  const auto snapshot = store.Current();
  const ServedModel* model = nullptr;
  QueryStatus status = Evaluate(*snapshot, request.model(), request.states(),
                                request.values_only(), &model, response->mutable_responses());
  response->set_sequence(request.sequence());
  response->set_generation(snapshot->generation());
  if (status.ok()) {
    response->set_model(model->reference);
    response->clear_error();
  } else {
    response->clear_model();
    response->clear_responses();
    response->mutable_error()->set_code(static_cast<int>(status.code));
    response->mutable_error()->set_message(status.message);
  }
  const std::chrono::duration<double, std::micro> spent =
      std::chrono::steady_clock::now() - start;
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
