#pragma once

#include <atomic>
#include <boost/lockfree/queue.hpp>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "grouser/v1alpha1/query_log.pb.h"
#include "server/core/metric_page.h"
#include "server/core/metrics.h"
#include "server/core/query_metrics.h"
#include "server/query/log/query_log_file.h"

namespace grouser::server {

/// Logs answered queries from a thread of its own. A query waits for nothing: it is serialised and
/// put into a queue without a lock; what does not fit there is dropped and counted.
class QueryLog {
 public:
  /// So many queries may wait to be written.
  static constexpr std::size_t kMostWaiting = 4096;

  /// Throws QueryLogRefused as QueryLogFile. Where the system fails nothing is logged, as when a
  /// later write fails.
  QueryLog(QueryLogOptions options, const v1alpha1::QueryLogHeader& header);
  /// Writes what waits.
  ~QueryLog();
  QueryLog(const QueryLog&) = delete;
  QueryLog& operator=(const QueryLog&) = delete;

  /// Any thread. Once the file could not be written (a full disk, say) nothing is any more, which
  /// is logged in one line.
  void Offer(Transport transport, const v1alpha1::EvaluateWheelsRequest& request,
             const v1alpha1::EvaluateWheelsResponse& response) noexcept;

  void AddTo(MetricPage* page) const;
  std::uint64_t written() const { return written_.value(); }
  std::uint64_t dropped() const { return dropped_.value(); }

 private:
  struct Record {
    std::unique_ptr<std::uint8_t[]> framed;
    std::size_t bytes;
  };
  static std::unique_ptr<Record> Serialise(Transport transport,
                                           const v1alpha1::EvaluateWheelsRequest& request,
                                           const v1alpha1::EvaluateWheelsResponse& response);
  void Fail(const std::exception& why);
  void Loop(const std::stop_token& stop);
  void WriteWaiting();

  boost::lockfree::queue<Record*, boost::lockfree::capacity<kMostWaiting>> waiting_;
  const std::size_t most_waiting_bytes_;
  std::atomic<std::size_t> waiting_bytes_{0};
  std::atomic<bool> writing_{true};
  Counter written_, written_bytes_, dropped_;
  std::optional<QueryLogFile> file_;  // of the thread; none: it could not be begun
  std::uint64_t appended_ = 0;        // of the thread
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace grouser::server
