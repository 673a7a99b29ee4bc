#pragma once

#include <grpcpp/support/server_callback.h>

#include "grouser/v1alpha1/terrain_service.grpc.pb.h"
#include "server/net/call_gate.h"
#include "server/query/grpc/answer.h"
#include "server/query/grpc/wheel_stream.h"

namespace grouser::server {

/// grouser.v1alpha1.TerrainService on gRPC's callback threads: a thin adapter
/// around Evaluate(). Nothing here blocks. What `path` names and `gate` must outlive the service.
class TerrainService final : public v1alpha1::TerrainService::CallbackService {
 public:
  TerrainService(const QueryPath& path, CallGate& gate);

  grpc::ServerUnaryReactor* EvaluateWheels(grpc::CallbackServerContext* context,
                                           const v1alpha1::EvaluateWheelsRequest* request,
                                           v1alpha1::EvaluateWheelsResponse* response) override;
  grpc::ServerBidiReactor<v1alpha1::EvaluateWheelsRequest, v1alpha1::EvaluateWheelsResponse>*
  StreamWheels(grpc::CallbackServerContext* context) override;
  grpc::ServerUnaryReactor* ListModels(grpc::CallbackServerContext* context,
                                       const v1alpha1::ListModelsRequest* request,
                                       v1alpha1::ListModelsResponse* response) override;
  grpc::ServerUnaryReactor* GetModel(grpc::CallbackServerContext* context,
                                     const v1alpha1::GetModelRequest* request,
                                     v1alpha1::GetModelResponse* response) override;
  grpc::ServerUnaryReactor* Explain(grpc::CallbackServerContext* context,
                                    const v1alpha1::ExplainRequest* request,
                                    v1alpha1::ExplainResponse* response) override;

 private:
  const QueryPath path_;
  CallGate& gate_;
  WheelMessages pool_;
};

}  // namespace grouser::server
