#include "dem_offline/campaign/workers.h"

#include <fmt/format.h>

#include <algorithm>
#include <thread>
#include <vector>

namespace grouser::campaign {

void Workers::Run(int jobs, const std::function<bool()>& next, const std::function<void()>& ended) {
  const auto work = [&] {
    try {
      while (!Stopping() && next()) {
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!error_) error_ = std::current_exception();
      failed_ = true;
    }
    if (ended) ended();
  };
  {
    std::vector<std::jthread> workers;
    for (int i = 0; i < jobs; ++i) workers.emplace_back(work);
  }
  if (error_) std::rethrow_exception(error_);
}

int JobsThatFit(int runs, int wanted, double largest_bytes, const dem::WorkLimits& limits,
                CampaignProgress& progress) {
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const int most = std::min(wanted > 0 ? wanted : cores, runs);
  const double together = dem::MostBytes(limits) / std::max(largest_bytes, 1.0);
  if (!(together < most)) return most;
  const int jobs = std::max(1, static_cast<int>(together));
  progress.Say(fmt::format("{} instead of {} runs at a time: one may need {:.3g} GiB of memory",
                           jobs, most, largest_bytes / 1073741824.0));
  return jobs;
}

}  // namespace grouser::campaign
