#pragma once

#include <atomic>
#include <exception>

namespace grouser::vehicle {

/// Thrown by work that was asked to stop.
class Stopped : public std::exception {
 public:
  const char* what() const noexcept override { return "stopped"; }
};

/// Set from any thread to end work that takes long; null: nothing does.
using StopFlag = const std::atomic<bool>*;

/// Throws Stopped where the flag is set. One load, no allocation otherwise.
inline void StopIfAsked(StopFlag stop) {
  if (stop != nullptr && stop->load(std::memory_order_relaxed)) throw Stopped();
}

}  // namespace grouser::vehicle
