#pragma once

#include <lcm/lcm.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <thread>

#include "proto/lcm/group_receiver.h"
#include "server/core/query_metrics.h"
#include "server/core/snapshot_store.h"
#include "server/query/log/query_log.h"

namespace grouser::server {

/// The LCM side of grouser-server: answers GROUSER_QUERY on GROUSER_RESPONSE
/// (and GROUSER_MEASURED) from a thread of its own. liblcm publishes; what comes in is received and
/// checked by GroupReceiver, so that no datagram can end the program. Messages
/// in fragments are ignored: no query is that long. `log` (null: none) gets what was answered. All
/// of these must outlive it.
class LcmServer {
 public:
  /// Receives on `interface` alone. Throws std::runtime_error "lcm: ..." when LCM
  /// cannot work here; without a multicast route by that interface it names the
  /// two commands that give one.
  LcmServer(const std::string& url, const std::string& interface, const SnapshotStore& store,
            QueryMetrics& metrics, QueryLog* log);
  ~LcmServer();
  LcmServer(const LcmServer&) = delete;
  LcmServer& operator=(const LcmServer&) = delete;

  const std::string& url() const { return url_; }

  /// What came in so far; any thread.
  void AddTo(MetricPage* page) const;

 private:
  void Loop();
  void TakeMessages();
  void Answer(std::span<const std::uint8_t> query);
  void WarnOfBadDatagrams();

  /// The receiver's counts, for other threads.
  struct Told {
    Counter messages, fragments, malformed, lost, not_queries;
  };

  const SnapshotStore& store_;
  QueryMetrics& metrics_;
  QueryLog* log_;
  std::string url_;
  lcm_io::GroupReceiver receiver_;
  std::unique_ptr<lcm_t, void (*)(lcm_t*)> publisher_;
  int stop_fd_ = -1;
  std::uint64_t malformed_ = 0, told_ = 0;
  Told counts_;
  std::thread thread_;
};

}  // namespace grouser::server
