#include "server/net/load_keeper.h"

#include <malloc.h>

namespace grouser::server {
namespace {

// Free memory that the heap keeps, so that the next big message finds its pages.
constexpr std::size_t kKeepBytes = 32 * 1024 * 1024;

}  // namespace

LoadKeeper::LoadKeeper(boost::asio::io_context& loop, LoadControl& load)
    : load_(load), timer_(loop) {}

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
  if (::mallinfo2().fordblks > kKeepBytes) ::malloc_trim(0);
}

}  // namespace grouser::server
