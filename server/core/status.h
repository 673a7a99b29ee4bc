#pragma once

#include <string>
#include <utility>

namespace grouser::server {

/// Why a whole message was refused. Values equal grpc::StatusCode, so that an
/// adapter can pass them on without this library knowing gRPC.
enum class QueryCode : int {
  kOk = 0,
  kInvalidArgument = 3,
  kNotFound = 5,
  kResourceExhausted = 8,
  kUnavailable = 14,
};

/// Outcome of one message. `message` names the field, what it was and what was
/// expected; empty when ok.
struct QueryStatus {
  QueryCode code = QueryCode::kOk;
  std::string message;

  bool ok() const { return code == QueryCode::kOk; }

  static QueryStatus Ok() { return {}; }
  static QueryStatus InvalidArgument(std::string text) {
    return {QueryCode::kInvalidArgument, std::move(text)};
  }
  static QueryStatus NotFound(std::string text) { return {QueryCode::kNotFound, std::move(text)}; }
  static QueryStatus ResourceExhausted(std::string text) {
    return {QueryCode::kResourceExhausted, std::move(text)};
  }
};

}  // namespace grouser::server
