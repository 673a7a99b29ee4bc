#include "server/query/grpc/terrain_service.h"

#include "server/net/grpc_status.h"
#include "server/query/grpc/describe_models.h"
#include "server/query/grpc/explain_state.h"

namespace grouser::server {
namespace {

// Pairs of messages kept for reuse: as many as run at once on a big machine
// (gRPC has at most 16 callback threads); 10,000 states take some 5 MB each.
constexpr std::size_t kIdleMessages = 16;

}  // namespace

TerrainService::TerrainService(const QueryPath& path, CallGate& gate)
    : path_(path), gate_(gate), pool_(kIdleMessages) {
  SetMessageAllocatorFor_EvaluateWheels(&pool_);
  gate.load().OnIdle([this] { pool_.Clear(); });
}

grpc::ServerUnaryReactor* TerrainService::EvaluateWheels(
    grpc::CallbackServerContext* context, const v1alpha1::EvaluateWheelsRequest* request,
    v1alpha1::EvaluateWheelsResponse* response) {
  return AnswerNow(gate_, *context, "TerrainService/EvaluateWheels", *request, *response, [&] {
    return ToGrpcStatus(Answer(path_, Transport::kUnary, *request, response));
  });
}

grpc::ServerBidiReactor<v1alpha1::EvaluateWheelsRequest, v1alpha1::EvaluateWheelsResponse>*
TerrainService::StreamWheels(grpc::CallbackServerContext* context) {
  return new WheelStream(path_, gate_, *context, pool_);
}

grpc::ServerUnaryReactor* TerrainService::ListModels(grpc::CallbackServerContext* context,
                                                     const v1alpha1::ListModelsRequest* request,
                                                     v1alpha1::ListModelsResponse* response) {
  return AnswerNow(gate_, *context, "TerrainService/ListModels", *request, *response, [&] {
    return ToGrpcStatus(server::ListModels(*path_.store.Current(), *request, response));
  });
}

grpc::ServerUnaryReactor* TerrainService::GetModel(grpc::CallbackServerContext* context,
                                                   const v1alpha1::GetModelRequest* request,
                                                   v1alpha1::GetModelResponse* response) {
  return AnswerNow(gate_, *context, "TerrainService/GetModel", *request, *response, [&] {
    return ToGrpcStatus(server::GetModel(*path_.store.Current(), *request, response));
  });
}

grpc::ServerUnaryReactor* TerrainService::Explain(grpc::CallbackServerContext* context,
                                                  const v1alpha1::ExplainRequest* request,
                                                  v1alpha1::ExplainResponse* response) {
  return AnswerNow(gate_, *context, "TerrainService/Explain", *request, *response, [&] {
    return ToGrpcStatus(ExplainState(*path_.store.Current(), *request, response));
  });
}

}  // namespace grouser::server
