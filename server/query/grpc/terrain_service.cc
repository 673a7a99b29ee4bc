#include "server/query/grpc/terrain_service.h"

#include "server/query/grpc/answer.h"
#include "server/query/grpc/grpc_status.h"

namespace grouser::server {
namespace {

// Pairs of messages kept for reuse: as many as run at once on a big machine
// (gRPC has at most 16 callback threads); 10,000 states take some 5 MB each.
constexpr std::size_t kIdleMessages = 16;

}  // namespace

TerrainService::TerrainService(const SnapshotStore& store) : store_(store), pool_(kIdleMessages) {
  SetMessageAllocatorFor_EvaluateWheels(&pool_);
}

grpc::ServerUnaryReactor* TerrainService::EvaluateWheels(
    grpc::CallbackServerContext* context, const v1alpha1::EvaluateWheelsRequest* request,
    v1alpha1::EvaluateWheelsResponse* response) {
  auto* reactor = context->DefaultReactor();
  if (context->IsCancelled()) {  // the deadline passed in the queue
    reactor->Finish(grpc::Status::CANCELLED);
    return reactor;
  }
  reactor->Finish(ToGrpcStatus(Answer(store_, *request, response)));
  return reactor;
}

grpc::ServerBidiReactor<v1alpha1::EvaluateWheelsRequest, v1alpha1::EvaluateWheelsResponse>*
TerrainService::StreamWheels(grpc::CallbackServerContext* /*context*/) {
  return new WheelStream(store_, streams_);
}

grpc::ServerUnaryReactor* TerrainService::ListModels(grpc::CallbackServerContext* context,
                                                     const v1alpha1::ListModelsRequest* /*request*/,
                                                     v1alpha1::ListModelsResponse* response) {
  auto* reactor = context->DefaultReactor();
  DescribeModels(store_, response);
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

}  // namespace grouser::server
