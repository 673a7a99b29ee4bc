#include "surrogate/terrain_map/progress.h"

#include <fmt/format.h>
#include <pthread.h>

#include <cmath>

namespace grouser::terrain_map {

HeldSignals::HeldSignals() {
  sigemptyset(&held_);
  sigaddset(&held_, SIGINT);
  sigaddset(&held_, SIGTERM);
  sigaddset(&held_, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &held_, &before_);
}

bool HeldSignals::Pending() const {
  sigset_t pending;
  sigpending(&pending);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    if (sigismember(&pending, signal) == 1) return true;
  }
  return false;
}

double ProgressReport::Elapsed() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

void ProgressReport::Stage(const std::string& name) {
  stage_ = name;
  start_ = shown_ = Clock::now();
  quarter_ = 0;
  Tick(0);
}

void ProgressReport::Tick(double done) {
  if (signals_ != nullptr && signals_->Pending()) {
    if (live_) std::fputs("\r\x1b[K", stderr);
    throw Interrupted("interrupted while " + stage_ + "; nothing was left behind");
  }
  const auto left = [&] { return std::lround(std::ceil(Elapsed() * (1 - done) / done)); };
  if (live_ && done > 0 && Clock::now() - shown_ > std::chrono::milliseconds(200)) {
    shown_ = Clock::now();
    fmt::print(stderr, "\r\x1b[K{}: {:.0f} %, ETA {} s", stage_, 100 * done, left());
  }
  const int quarter = static_cast<int>(4 * done);
  if (!live_ && quarter > quarter_ && done < 1 && Elapsed() > 5) {
    fmt::print(stderr, "{}: {} %, {} s left\n", stage_, 25 * quarter, left());
  }
  quarter_ = quarter;
}

void ProgressReport::Done() {
  fmt::print(stderr, "{}{}: {:.1f} s\n", live_ ? "\r\x1b[K" : "", stage_, Elapsed());
}

}  // namespace grouser::terrain_map
