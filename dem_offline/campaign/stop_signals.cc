#include "dem_offline/campaign/stop_signals.h"

#include <pthread.h>
#include <unistd.h>

#include <ctime>

namespace grouser::campaign {

StopSignals::StopSignals() {
  sigemptyset(&signals_);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals_, signal);
  pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  // A write to a closed pipe shall be an error, not the end; so shall a file
  // beyond the size limit.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  waiter_ = std::jthread([this](std::stop_token done) { Wait(done); });
}

StopSignals::~StopSignals() = default;  // the jthread asks Wait to end and joins

void StopSignals::Wait(std::stop_token done) {
  const timespec slice{0, 100'000'000};
  while (!done.stop_requested()) {
    const int signal = sigtimedwait(&signals_, nullptr, &slice);
    if (signal < 0) continue;
    if (stop_ || at_once_) _exit(128 + signal);
    signal_ = signal;
    stop_ = true;
  }
}

}  // namespace grouser::campaign
