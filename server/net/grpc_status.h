#pragma once

#include <grpcpp/support/status.h>

#include <string>

#include "server/core/status.h"

namespace grouser::server {

/// Longest text of a status: gRPC clients take 8 KiB of headers, and drop more.
inline constexpr std::size_t kMaxStatusBytes = 4096;

/// The one place where a gRPC status is made of ours. Whatever a request had in
/// it, its text stays short enough to arrive.
inline grpc::Status ToGrpcStatus(const Status& status) {
  if (status.ok()) return grpc::Status::OK;
  std::string text = status.message;
  if (text.size() > kMaxStatusBytes) {
    std::size_t end = kMaxStatusBytes;
    while (end > 0 && (text[end] & 0xc0) == 0x80) --end;  // not inside a UTF-8 character
    text.resize(end);
    text += "...";
  }
  return {static_cast<grpc::StatusCode>(status.code), text};
}

}  // namespace grouser::server
