#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>

#include "server/net/load_control.h"

namespace grouser::server {

/// What must be done about load from time to time, on `loop`: calls whose clients take no answer
/// are cancelled, and memory that a busy time left behind goes back to the kernel once nothing has
/// come for kIdle.
class LoadKeeper {
 public:
  static constexpr std::chrono::milliseconds kPeriod{250};
  static constexpr std::chrono::seconds kIdle{3};

  LoadKeeper(boost::asio::io_context& loop, LoadControl& load);
  /// On the loop's thread, or before it runs.
  void Start();

 private:
  void Tick();
  void TrimOnceIdle(LoadControl::Clock::time_point now);

  LoadControl& load_;
  boost::asio::steady_timer timer_;
  std::uint64_t seen_ = 0;
  LoadControl::Clock::time_point last_message_{};
  bool trimmed_ = true;
  const std::size_t start_bytes_;  // resident
};

}  // namespace grouser::server
