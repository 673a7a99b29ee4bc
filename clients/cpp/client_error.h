#pragma once

#include <grpcpp/support/status.h>

#include <stdexcept>
#include <string>

namespace grouser::client {

/// A call that the server refused or that did not reach it. what() is
/// "CODE_NAME: text of the server".
class ClientError : public std::runtime_error {
 public:
  ClientError(grpc::StatusCode code, const std::string& text);
  grpc::StatusCode code() const { return code_; }

 private:
  grpc::StatusCode code_;
};

/// "INVALID_ARGUMENT" and so on; the number for an unknown one.
std::string StatusCodeName(int code);

/// Throws ClientError unless `status` is OK; names the address when the server
/// cannot be reached.
void ThrowUnlessOk(const grpc::Status& status, const std::string& address);

}  // namespace grouser::client
