#pragma once

#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <optional>
#include <stdexcept>
#include <string>

#include "clients/cpp/channel.h"
#include "google/rpc/status.pb.h"

namespace grouser::client {

/// A call that the server refused or that did not reach it. what() is
/// "CODE_NAME: text of the server".
class ClientError : public std::runtime_error {
 public:
  ClientError(grpc::StatusCode code, const std::string& text,
              std::optional<Milliseconds> retry_after = std::nullopt);
  grpc::StatusCode code() const { return code_; }
  /// How long an overloaded server asks to wait before the next try.
  std::optional<Milliseconds> retry_after() const { return retry_after_; }

 private:
  grpc::StatusCode code_;
  std::optional<Milliseconds> retry_after_;
};

/// Throws ClientError unless `status` is OK; names the address when the server
/// cannot be reached, and what is wrong with TLS if that is why. `context`: of the call that has
/// ended, for its retry hint.
void ThrowUnlessOk(const grpc::Status& status, const Server& server,
                   const grpc::ClientContext* context = nullptr);

/// The retry hint of a message that was refused in band, on a stream.
std::optional<Milliseconds> RetryAfter(const google::rpc::Status& error);

/// The response to one unary call of a stub's method; throws as ThrowUnlessOk.
template <class Stub, class Request, class Response>
Response Call(Stub& stub,
              grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
              const Request& request, const Server& server, Milliseconds deadline) {
  grpc::ClientContext context;
  context.set_deadline(DeadlineAfter(deadline));
  Response response;
  ThrowUnlessOk((stub.*method)(&context, request, &response), server, &context);
  return response;
}

}  // namespace grouser::client
