#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>

namespace grouser::server {

/// Tells the service manager (systemd, `Type=notify`) what the program does, by the socket that
/// $NOTIFY_SOCKET names; without one nothing happens. sd_notify(3), sd_watchdog_enabled(3).
class ServiceManager {
 public:
  /// The watchdog is fed on `loop`, twice in each period of $WATCHDOG_USEC: a loop that hangs is
  /// restarted by the manager.
  explicit ServiceManager(boost::asio::io_context& loop) : timer_(loop) {}

  /// It answers; from now on the watchdog is fed.
  void Ready();
  /// It drains. The watchdog is fed until the loop ends.
  void Stopping();

 private:
  void FeedWatchdog(std::chrono::microseconds period);

  boost::asio::steady_timer timer_;
};

}  // namespace grouser::server
