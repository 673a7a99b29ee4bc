#pragma once

#include <chrono>
#include <csignal>
#include <cstdio>
#include <stdexcept>
#include <string>

namespace grouser::terrain_map {

/// SIGINT, SIGTERM or SIGHUP came.
class Interrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Holds SIGINT, SIGTERM and SIGHUP back, so that work ends where it looks for them and cleans up.
/// Before any thread is made.
class HeldSignals {
 public:
  HeldSignals();
  bool Pending() const;
  /// The mask that a child process starts with.
  const sigset_t& before() const { return before_; }

 private:
  sigset_t held_, before_;
};

/// Says on stderr how far the stages of a work are: a live line with the time to go on a terminal,
/// else a line a quarter.
class ProgressReport {
 public:
  /// `signals` may be null: none are held.
  ProgressReport(const HeldSignals* signals, bool live) : signals_(signals), live_(live) {}
  void Stage(const std::string& name);
  /// Share of the stage that is done. Throws Interrupted.
  void Tick(double done);
  /// Ends the stage's line.
  void Done();

 private:
  using Clock = std::chrono::steady_clock;
  double Elapsed() const;

  const HeldSignals* signals_;
  bool live_;
  std::string stage_;
  Clock::time_point start_, shown_;
  int quarter_ = 0;
};

}  // namespace grouser::terrain_map
