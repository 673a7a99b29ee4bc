#include "dem_offline/engine/world/team.h"

namespace grouser::dem {
namespace {
constexpr int kSpins = 4000;  // a step takes tens of microseconds: a blocking wait costs more
}

Team::Team(int threads) {
  for (int part = 1; part < threads; ++part) workers_.emplace_back([this, part] { Work(part); });
}

Team::~Team() {
  stop_ = true;
  ++round_;
  round_.notify_all();
  for (auto& w : workers_) w.join();
}

void Team::Run(const std::function<void(int)>& f) {
  if (workers_.empty()) return f(0);
  job_ = &f;
  busy_ = static_cast<int>(workers_.size());
  ++round_;
  round_.notify_all();
  f(0);
  for (int spin = 0; busy_.load() > 0; ++spin) {
    if (spin > kSpins) std::this_thread::yield();
  }
}

void Team::Work(int part) {
  for (std::uint64_t seen = 0;;) {
    for (int spin = 0; spin < kSpins && round_.load() == seen; ++spin) {
    }
    round_.wait(seen);
    seen = round_.load();
    if (stop_) return;
    (*job_)(part);
    --busy_;
  }
}

}  // namespace grouser::dem
