#pragma once

#include <grpcpp/support/status.h>

#include "server/core/status.h"

namespace grouser::server {

/// The one place where gRPC statuses are made.
inline grpc::Status ToGrpcStatus(const QueryStatus& status) {
  if (status.ok()) return grpc::Status::OK;
  return {static_cast<grpc::StatusCode>(static_cast<int>(status.code)), status.message};
}

}  // namespace grouser::server
