#pragma once

#include <stdexcept>
#include <string>

namespace grouser::server {

/// Why a request about jobs is refused. Values equal grpc::StatusCode, so that
/// the adapter passes them on and the rest of the folder knows no gRPC.
enum class RequestCode : int {
  kInvalidArgument = 3,
  kNotFound = 5,
  kAlreadyExists = 6,
  kResourceExhausted = 8,
  kFailedPrecondition = 9,
  kInternal = 13,
  kUnavailable = 14,
};

/// Thrown by everything that judges a request; the message names the field,
/// what it was and what was expected.
class RequestError : public std::runtime_error {
 public:
  RequestError(RequestCode code, const std::string& message)
      : std::runtime_error(message), code_(code) {}
  RequestCode code() const { return code_; }

 private:
  RequestCode code_;
};

}  // namespace grouser::server
