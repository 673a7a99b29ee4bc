#include "server/net/load_keeper.h"

#include <malloc.h>
#include <unistd.h>

#include <fstream>

namespace grouser::server {
namespace {

// More resident memory than at the start that is kept, so that the next big message finds its
// pages.
constexpr std::size_t kKeepBytes = 16 * 1024 * 1024;

/// Of this program; 0 where the kernel does not tell.
std::size_t ResidentBytes() {
  std::ifstream in("/proc/self/statm");
  std::size_t size = 0, resident = 0;
  in >> size >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace

LoadKeeper::LoadKeeper(boost::asio::io_context& loop, LoadControl& load)
    : load_(load), timer_(loop), start_bytes_(ResidentBytes()) {}

void LoadKeeper::Start() {
  timer_.expires_after(kPeriod);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (error) return;
    Tick();
    Start();
  });
}

void LoadKeeper::Tick() {
  const auto now = LoadControl::Clock::now();
  load_.CancelStuck(now);
  TrimOnceIdle(now);
}

void LoadKeeper::TrimOnceIdle(LoadControl::Clock::time_point now) {
  if (const auto messages = load_.messages(); messages != seen_) {
    seen_ = messages;
    last_message_ = now;
    trimmed_ = false;
  }
  if (trimmed_ || now - last_message_ < kIdle) return;
  trimmed_ = true;
  load_.DropSpare();
  if (ResidentBytes() > start_bytes_ + kKeepBytes) ::malloc_trim(0);
}

}  // namespace grouser::server
