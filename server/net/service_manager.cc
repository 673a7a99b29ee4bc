#include "server/net/service_manager.h"

#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <cstdint>
#include <cstring>

namespace grouser::server {

namespace {

/// A manager that cannot be told stops the program when its time is up; the log says why.
void Tell(const char* state) {
  const int code = sd_notify(/*unset_environment=*/0, state);
  if (code < 0) spdlog::warn("service manager: {}: {}", state, std::strerror(-code));
}

}  // namespace

void ServiceManager::Ready() {
  Tell("READY=1");
  std::uint64_t period_us = 0;
  const int code = sd_watchdog_enabled(/*unset_environment=*/0, &period_us);
  if (code < 0) spdlog::warn("service manager: $WATCHDOG_USEC: {}", std::strerror(-code));
  if (code > 0) FeedWatchdog(std::chrono::microseconds(period_us) / 2);
}

void ServiceManager::Stopping() { Tell("STOPPING=1"); }

void ServiceManager::FeedWatchdog(std::chrono::microseconds period) {
  Tell("WATCHDOG=1");
  timer_.expires_after(period);
  timer_.async_wait([this, period](const boost::system::error_code& error) {
    if (!error) FeedWatchdog(period);
  });
}

}  // namespace grouser::server
