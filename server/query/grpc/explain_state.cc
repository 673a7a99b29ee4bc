#include "server/query/grpc/explain_state.h"

#include <fmt/format.h>

#include <exception>

#include "server/core/evaluator.h"
#include "surrogate/model_io/explain.h"

namespace grouser::server {

Status ExplainState(const Snapshot& snapshot, const v1alpha1::ExplainRequest& request,
                    v1alpha1::ExplainResponse* response) {
  const ServedModel* model = nullptr;
  if (Status status = snapshot.Find(request.model(), &model); !status.ok()) return status;
  if (Status status = ValidateStates(request.state(), 1); !status.ok()) {
    // The field has another name here.
    return {status.code, "state: " + status.message};
  }
  if (request.max_runs() > surrogate::kMostRuns) {
    return Status::InvalidArgument(fmt::format("max_runs: {}, expected 0 (for {}) to {}",
                                               request.max_runs(), surrogate::kUsualRuns,
                                               surrogate::kMostRuns));
  }
  const int runs =
      request.max_runs() == 0 ? surrogate::kUsualRuns : static_cast<int>(request.max_runs());
  response->set_generation(snapshot.generation());
  try {
    *response->mutable_explanation() = surrogate::Explain(
        {model->message, model->reference, *model->evaluator}, request.state(), runs);
  } catch (const std::exception& e) {  // a model that answers, but whose parts cannot be read
    return {StatusCode::kInternal, e.what()};
  }
  return Status::Ok();
}

}  // namespace grouser::server
