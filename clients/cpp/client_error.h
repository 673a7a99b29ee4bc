#pragma once

#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <stdexcept>
#include <string>

#include "clients/cpp/channel.h"

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
/// cannot be reached, and what is wrong with TLS if that is why.
void ThrowUnlessOk(const grpc::Status& status, const Server& server);

/// The response to one unary call of a stub's method; throws as ThrowUnlessOk.
template <class Stub, class Request, class Response>
Response Call(Stub& stub,
              grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
              const Request& request, const Server& server, Milliseconds deadline) {
  grpc::ClientContext context;
  context.set_deadline(DeadlineAfter(deadline));
  Response response;
  ThrowUnlessOk((stub.*method)(&context, request, &response), server);
  return response;
}

}  // namespace grouser::client
