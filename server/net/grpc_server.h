#pragma once

#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "server/net/call_gate.h"
#include "server/net/listener.h"
#include "server/net/net_options.h"
#include "server/net/self_probe.h"

namespace grouser::server {

/// One service on one address, with the standard health service and reflection:
/// the gRPC side of both programs. Connections are accepted by a Listener.
class GrpcServer {
 public:
  /// Serves. `service` passes its calls through `gate`; both outlive the
  /// server. `service_name` is the full name of the service, for health.
  /// `on_unreachable`: on a thread of the server, when new clients cannot get
  /// through any more; the program should Drain() and end. Throws
  /// std::runtime_error "grpc: ADDR: ..." when it cannot listen.
  GrpcServer(const NetOptions& options, grpc::Service& service, CallGate& gate,
             std::string service_name, std::function<void()> on_unreachable);
  ~GrpcServer();

  /// With the port that was taken.
  std::string address() const { return listener_->address().Text(); }

  /// Health of the service; that of the whole server ("") is SERVING always.
  void SetServing(bool serving);

  /// Health NOT_SERVING, no new connections; answers what was sent before, for
  /// at most 0.8 drain_s, then refuses what still comes with UNAVAILABLE and
  /// tells the streams to end. Blocks.
  void Drain();
  /// Lets the calls under way end, for at most 0.2 drain_s (0.2 s at least), and
  /// closes all connections. Idempotent.
  void Close();

 private:
  void StopListening();

  NetOptions options_;
  CallGate& gate_;
  std::string service_name_;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor_;
  std::unique_ptr<grpc::Server> server_;
  boost::asio::io_context loop_{1};
  std::unique_ptr<Listener> listener_;
  std::optional<SelfProbe> probe_;
  std::jthread thread_;  // runs loop_
};

}  // namespace grouser::server
