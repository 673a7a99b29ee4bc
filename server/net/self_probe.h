#pragma once

#include <grpcpp/security/credentials.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

namespace grouser::server {

/// Asks the server's own address for its health over a fresh connection, again
/// and again: the one test that covers all that a new client needs.
class SelfProbe {
 public:
  static constexpr int kFailures = 3;  ///< in a row: the server is unreachable
  static constexpr std::chrono::seconds kDeadline{5};

  /// Skips a turn while `skip` holds. Calls `on_unreachable` once, then stops.
  /// Both on a thread of its own.
  SelfProbe(std::string address, std::shared_ptr<grpc::ChannelCredentials> credentials,
            std::chrono::duration<double> period, std::function<bool()> skip,
            std::function<void()> on_unreachable);

 private:
  std::jthread thread_;
};

}  // namespace grouser::server
