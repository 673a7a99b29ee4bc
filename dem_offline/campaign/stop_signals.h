#pragma once

#include <atomic>
#include <csignal>
#include <thread>

namespace grouser::campaign {

/// Turns SIGINT, SIGTERM and SIGHUP into a flag. Made first in main(), so that
/// every later thread inherits the blocked mask; a thread of its own waits for
/// them. A second signal ends the process at once (files are only ever renamed
/// into place, so nothing half-written remains under a final name).
class StopSignals {
 public:
  StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;
  ~StopSignals();

  const std::atomic<bool>& stop() const { return stop_; }
  /// For work that looks at no flag and leaves nothing half-written: from now on
  /// the first signal ends the process, too.
  void EndAtOnce() const { at_once_ = true; }
  /// 130 after SIGINT, 143 after SIGTERM, 129 after SIGHUP, else 0.
  int exit_code() const { return signal_ == 0 ? 0 : 128 + signal_; }

 private:
  void Wait(std::stop_token done);

  sigset_t signals_;
  std::atomic<bool> stop_{false};
  std::atomic<int> signal_{0};
  mutable std::atomic<bool> at_once_{false};
  std::jthread waiter_;
};

}  // namespace grouser::campaign
