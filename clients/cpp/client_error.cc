#include "clients/cpp/client_error.h"

#include <iterator>

namespace grouser::client {

std::string StatusCodeName(int code) {
  static constexpr const char* kNames[] = {"OK",
                                           "CANCELLED",
                                           "UNKNOWN",
                                           "INVALID_ARGUMENT",
                                           "DEADLINE_EXCEEDED",
                                           "NOT_FOUND",
                                           "ALREADY_EXISTS",
                                           "PERMISSION_DENIED",
                                           "RESOURCE_EXHAUSTED",
                                           "FAILED_PRECONDITION",
                                           "ABORTED",
                                           "OUT_OF_RANGE",
                                           "UNIMPLEMENTED",
                                           "INTERNAL",
                                           "UNAVAILABLE",
                                           "DATA_LOSS",
                                           "UNAUTHENTICATED"};
  if (code < 0 || code >= std::ssize(kNames)) return std::to_string(code);
  return kNames[code];
}

ClientError::ClientError(grpc::StatusCode code, const std::string& text)
    : std::runtime_error(StatusCodeName(code) + ": " + text), code_(code) {}

void ThrowUnlessOk(const grpc::Status& status, const std::string& address) {
  if (status.ok()) return;
  std::string text = status.error_message();
  if (status.error_code() == grpc::StatusCode::UNAVAILABLE) {
    text += " (server " + address + "; is it running? ./grouser serve starts it)";
  }
  throw ClientError(status.error_code(), text);
}

}  // namespace grouser::client
