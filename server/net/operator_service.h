#pragma once

#include "grouser/v1alpha1/operator_service.grpc.pb.h"
#include "server/net/call_gate.h"

namespace grouser::server {

/// grouser.v1alpha1.OperatorService: what runs here. `gate` must outlive it.
class OperatorService final : public v1alpha1::OperatorService::CallbackService {
 public:
  OperatorService(v1alpha1::GetBuildInfoResponse build, CallGate& gate)
      : build_(std::move(build)), gate_(gate) {}

  const v1alpha1::GetBuildInfoResponse& build() const { return build_; }

  grpc::ServerUnaryReactor* GetBuildInfo(grpc::CallbackServerContext* context,
                                         const v1alpha1::GetBuildInfoRequest* request,
                                         v1alpha1::GetBuildInfoResponse* response) override {
    return AnswerNow(gate_, *context, "OperatorService/GetBuildInfo", *request, *response, [&] {
      *response = build_;
      return grpc::Status::OK;
    });
  }

 private:
  const v1alpha1::GetBuildInfoResponse build_;
  CallGate& gate_;
};

}  // namespace grouser::server
