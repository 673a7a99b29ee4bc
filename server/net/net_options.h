#pragma once

#include <string>

#include "server/net/tls_files.h"

namespace CLI {
class App;
}

namespace grouser::server {

/// How a program serves gRPC. Both programs take the same options.
struct NetOptions {
  std::string grpc;       ///< HOST:PORT (0: a free port) or unix:PATH
  std::string port_file;  ///< receives "grpc=ADDR" when ready; empty: none
  int max_connections = 1000;
  /// A connection without a call for so long is closed (up to twice that, gRPC
  /// looks so often); one that never says anything, after at most 10 s.
  double idle_s = 30;
  /// From SIGTERM on, what was sent before it is answered for at most so long.
  double drain_s = 2;
  /// Between two tries to reach oneself; 0: none.
  double probe_s = 10;
  /// For requests and answers under way, over all connections; see LoadControl::Limits.
  int memory_budget_mb = 256;
  /// Calls under way on a connection; its client holds further ones back.
  int max_calls = 8;
  /// An answer that its client does not take within it is cancelled.
  double answer_s = 10;
  int max_receive_bytes = 4 * 1024 * 1024;
  TlsFiles tls;
  std::string rights;       ///< file of who may do what; empty: see AccessPolicy
  bool insecure = false;    ///< plaintext although other machines reach it
  bool reflection = false;  ///< clients may ask for the services' descriptions

  void AddTo(CLI::App& app);
  /// Throws std::invalid_argument where plaintext would leave the machine and
  /// nobody asked for that, and for a bad file of TLS or of rights.
  void Validate() const;

 private:
  void AddSecurityTo(CLI::App& app);
};

}  // namespace grouser::server
