#pragma once

#include <lcm/lcm.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include "server/core/snapshot_store.h"

namespace grouser::server {

/// The LCM side of grouser-server: answers GROUSER_QUERY on GROUSER_RESPONSE
/// from a thread of its own. `store` must outlive it.
class LcmServer {
 public:
  /// Throws std::runtime_error "lcm: ..." when LCM cannot work here; without a
  /// multicast route it names the two commands that give one.
  LcmServer(const std::string& url, const SnapshotStore& store);
  ~LcmServer();
  LcmServer(const LcmServer&) = delete;
  LcmServer& operator=(const LcmServer&) = delete;

  const std::string& url() const { return url_; }
  /// Messages on the query channel that were no wheel_query_t.
  std::uint64_t malformed() const { return malformed_; }

 private:
  void Loop();
  void Receive(const lcm_recv_buf_t& buffer);

  const SnapshotStore& store_;
  std::string url_;
  std::unique_ptr<lcm_t, void (*)(lcm_t*)> lcm_;
  int stop_fd_ = -1;
  std::atomic<std::uint64_t> malformed_ = 0;
  std::thread thread_;
};

}  // namespace grouser::server
