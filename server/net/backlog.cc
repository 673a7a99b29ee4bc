#include "server/net/backlog.h"

#include <algorithm>

namespace grouser::server {
namespace {

using Seconds = std::chrono::duration<double>;
constexpr std::chrono::milliseconds kBetweenLooks(2), kRateOver(50);
constexpr int kMostShare = 30;  // one part in so many of the time goes into looking

}  // namespace

bool Backlog::TooLong(Clock::time_point now) {
  if (count_ && now >= next_look_.load()) {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (lock.owns_lock()) Look(now);
  }
  return too_long_;
}

void Backlog::Look(Clock::time_point now) {
  if (const Seconds span = now - rate_since_; span >= kRateOver) {
    const std::uint64_t done = done_;
    // After a pause the rate says nothing of how fast the server is.
    const bool recent = span < 4 * kRateOver;
    seconds_each_ =
        recent ? span.count() / static_cast<double>(std::max<std::uint64_t>(done - rate_from_, 1))
               : 0;
    rate_since_ = now;
    rate_from_ = done;
  }
  const auto before = Clock::now();
  const Seconds wait(static_cast<double>(count_()) * seconds_each_);
  const auto spent = Clock::now() - before;
  if (wait <= kMostWait) {
    long_since_ = Clock::time_point::max();
  } else {
    long_since_ = std::min(long_since_, now);
  }
  too_long_ = long_since_ <= now - kLasts;
  next_look_ = now + std::max<Clock::duration>(kBetweenLooks, kMostShare * spent);
}

}  // namespace grouser::server
