#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>

namespace grouser::server {

/// Tells whether requests wait for the server's threads: connections with unread bytes, over the
/// rate at which messages are done with, is how long the last of them will wait. gRPC reads and
/// answers on the same threads, so that a queue forms nowhere else. Thread-safe.
class Backlog {
 public:
  using Clock = std::chrono::steady_clock;
  /// A longer wait that lasts is too long. A burst that is over sooner is answered.
  static constexpr std::chrono::milliseconds kMostWait{10}, kLasts{100};

  /// `count_waiting`: connections with bytes that nobody has read.
  void SetCount(std::function<std::size_t()> count_waiting) { count_ = std::move(count_waiting); }
  /// A message has been answered or refused.
  void Done() { ++done_; }
  /// Looks again, at most every 2 ms and at most 3 % of the time.
  bool TooLong(Clock::time_point now);

 private:
  void Look(Clock::time_point now);

  std::function<std::size_t()> count_;
  std::atomic<std::uint64_t> done_{0};
  std::atomic<bool> too_long_{false};
  std::atomic<Clock::time_point> next_look_{};
  std::mutex mutex_;  // of what follows
  Clock::time_point rate_since_{}, long_since_ = Clock::time_point::max();
  std::uint64_t rate_from_ = 0;
  double seconds_each_ = 0;
};

}  // namespace grouser::server
