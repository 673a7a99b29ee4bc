#include "clients/cpp/client_error.h"

#include <iterator>

#include "clients/cpp/credentials.h"

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

void ThrowUnlessOk(const grpc::Status& status, const Server& server) {
  if (status.ok()) return;
  std::string text = status.error_message();
  if (status.error_code() == grpc::StatusCode::UNAVAILABLE) {
    const std::string problem = TlsProblem(server);
    text += " (server " + server.address + "; " +
            (problem.empty() ? "is it running? ./grouser serve starts it" : problem) + ")";
  }
  if (status.error_code() == grpc::StatusCode::UNAUTHENTICATED) {
    text += " (a caller shows who it is by --token-file, or by --tls-cert and --tls-key)";
  }
  throw ClientError(status.error_code(), text);
}

}  // namespace grouser::client
