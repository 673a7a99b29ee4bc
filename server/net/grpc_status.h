#pragma once

#include <grpcpp/support/status.h>

#include "server/core/status.h"

namespace grouser::server {

/// The one place where a gRPC status is made of ours.
inline grpc::Status ToGrpcStatus(const Status& status) {
  if (status.ok()) return grpc::Status::OK;
  return {static_cast<grpc::StatusCode>(status.code), status.message};
}

}  // namespace grouser::server
