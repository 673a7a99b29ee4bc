#pragma once

#include <time.h>

#include <atomic>
#include <chrono>
#include <exception>

namespace grouser::vehicle {

/// Thrown by work that was asked to stop.
class Stopped : public std::exception {
 public:
  const char* what() const noexcept override { return "stopped"; }
};
/// Thrown by work that has used up its processor time.
class OutOfTime final : public Stopped {
 public:
  const char* what() const noexcept override { return "out of time"; }
};

/// Processor time of the calling thread, from its start on.
inline std::chrono::nanoseconds ThreadTime() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

/// What ends work that takes long: a flag that any thread sets, and processor time. By default
/// nothing.
class StopWhen {
 public:
  StopWhen() = default;
  /// Null: no flag.
  explicit StopWhen(const std::atomic<bool>* flag) : flag_(flag) {}
  /// And the thread that calls this has worked for `limit` more, which is the one to do the work.
  StopWhen(const std::atomic<bool>* flag, std::chrono::nanoseconds limit)
      : flag_(flag), earliest_(Clock::now() + limit), until_(ThreadTime() + limit) {}

  bool FlagIsSet() const { return flag_ != nullptr && flag_->load(std::memory_order_relaxed); }
  /// A thread works no longer than time passes: its own clock, a system call, is looked at last.
  bool TimeHasCome() const {
    return earliest_ != Clock::time_point::max() && Clock::now() >= earliest_ &&
           ThreadTime() >= until_;
  }

 private:
  using Clock = std::chrono::steady_clock;

  const std::atomic<bool>* flag_ = nullptr;
  Clock::time_point earliest_ = Clock::time_point::max();
  std::chrono::nanoseconds until_{};
};

/// Throws Stopped where the flag is set, OutOfTime where the time has come; no allocation
/// otherwise.
inline void StopIfAsked(const StopWhen& stop) {
  if (stop.FlagIsSet()) throw Stopped();
  if (stop.TimeHasCome()) throw OutOfTime();
}

}  // namespace grouser::vehicle
