#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace grouser::server {

/// Why a message was refused. Values equal grpc::StatusCode, so that an adapter
/// can pass them on without this library knowing gRPC.
enum class StatusCode : int {
  kOk = 0,
  kInvalidArgument = 3,
  kNotFound = 5,
  kAlreadyExists = 6,
  kResourceExhausted = 8,
  kFailedPrecondition = 9,
  kInternal = 13,
  kUnavailable = 14,
};

/// Outcome of one message. `message` names the field, what it was and what was
/// expected; empty when ok.
struct Status {
  StatusCode code = StatusCode::kOk;
  std::string message;

  bool ok() const { return code == StatusCode::kOk; }

  static Status Ok() { return {}; }
  static Status InvalidArgument(std::string text) {
    return {StatusCode::kInvalidArgument, std::move(text)};
  }
  static Status NotFound(std::string text) { return {StatusCode::kNotFound, std::move(text)}; }
  static Status ResourceExhausted(std::string text) {
    return {StatusCode::kResourceExhausted, std::move(text)};
  }
};

/// A Status that is thrown, off the hot path.
class StatusError : public std::runtime_error {
 public:
  StatusError(StatusCode code, const std::string& message)
      : std::runtime_error(message), code_(code) {}
  explicit StatusError(const Status& status) : StatusError(status.code, status.message) {}
  StatusCode code() const { return code_; }
  Status status() const { return {code_, what()}; }

 private:
  StatusCode code_;
};

}  // namespace grouser::server
