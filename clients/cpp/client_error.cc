#include "clients/cpp/client_error.h"

#include "proto/records/status_code.h"

namespace grouser::client {

ClientError::ClientError(grpc::StatusCode code, const std::string& text)
    : std::runtime_error(records::StatusCodeName(code) + ": " + text), code_(code) {}

void ThrowUnlessOk(const grpc::Status& status, const std::string& address) {
  if (status.ok()) return;
  std::string text = status.error_message();
  if (status.error_code() == grpc::StatusCode::UNAVAILABLE) {
    text += " (server " + address + "; is it running? ./grouser serve starts it)";
  }
  throw ClientError(status.error_code(), text);
}

}  // namespace grouser::client
