#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <mutex>

#include "dem_offline/campaign/progress.h"
#include "dem_offline/engine/rig/work.h"

namespace grouser::campaign {

/// Threads that take one piece of work after another, until there is none, until they are
/// stopped, or until one of them throws.
class Workers {
 public:
  explicit Workers(const std::atomic<bool>& stop) : stop_(stop) {}

  bool Stopping() const { return stop_ || failed_; }
  /// next: does one piece; false: there is none. ended: each thread, before it ends. Throws what
  /// was thrown first, when all have ended.
  void Run(int jobs, const std::function<bool()>& next, const std::function<void()>& ended = {});

 private:
  const std::atomic<bool>& stop_;
  std::atomic<bool> failed_{false};
  std::mutex mutex_;  // error_
  std::exception_ptr error_;
};

/// Runs at a time: as many as wanted (0: one a core) and as there are, while all fit the memory
/// together; says so where it is fewer.
int JobsThatFit(int runs, int wanted, double largest_bytes, const dem::WorkLimits& limits,
                CampaignProgress& progress);

}  // namespace grouser::campaign
