#pragma once

#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/net/access_policy.h"
#include "server/net/call_gate.h"
#include "server/net/listener.h"
#include "server/net/load_keeper.h"
#include "server/net/net_options.h"
#include "server/net/self_probe.h"

namespace grouser::server {

/// A service by its full name, which health knows it by.
struct NamedService {
  grpc::Service* service;
  std::string name;
};

/// Services on one address, with the standard health service, and reflection if
/// asked for:
/// the gRPC side of both programs. Connections are accepted by a Listener.
class GrpcServer {
 public:
  /// Serves. The services pass their calls through `gate`; all outlive the server.
  /// `on_unreachable`: on a thread of the server, when new clients cannot get
  /// through any more; the program should Drain() and end. `policy` judges every
  /// call and outlives the server. Throws std::runtime_error "grpc: ADDR: ..."
  /// when it cannot listen; as ReadTls.
  GrpcServer(const NetOptions& options, const std::vector<NamedService>& services, CallGate& gate,
             AccessPolicy& policy, std::function<void()> on_unreachable);
  ~GrpcServer();

  /// With the port that was taken.
  std::string address() const { return listener_->address().Text(); }

  /// Calls from within this program; as those from outside, but for the connection.
  std::shared_ptr<grpc::Channel> InProcessChannel();
  std::size_t CountConnections() { return listener_->connections().CountOpen(); }

  /// Health of a service; that of the whole server ("") is SERVING always.
  void SetServing(const std::string& service, bool serving);

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
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor_;
  std::unique_ptr<grpc::Server> server_;
  boost::asio::io_context loop_{1};
  std::unique_ptr<Listener> listener_;
  LoadKeeper keeper_;
  std::optional<SelfProbe> probe_;
  std::jthread thread_;  // runs loop_
};

}  // namespace grouser::server
