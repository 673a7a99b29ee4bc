// What the machine's memory does at best, by its own threads.
#include <algorithm>
#include <cstring>
#include <memory>
#include <thread>
#include <vector>

#include "dem_offline/engine/bench/workload.h"

namespace grouser::dem::bench {
namespace {

constexpr std::size_t kBytes = std::size_t{1} << 28;  // of one array, shared out over the threads
constexpr int kTries = 4;

}  // namespace

double CopyRate(int threads) {
  const std::unique_ptr<char[]> from(new char[kBytes]), to(new char[kBytes]);
  const std::size_t share = kBytes / static_cast<std::size_t>(threads);
  const auto all = [&](auto&& work) {
    std::vector<std::thread> team;
    for (int t = 1; t < threads; ++t) team.emplace_back([&, t] { work(share * t); });
    work(std::size_t{0});
    for (std::thread& t : team) t.join();
  };
  all([&](std::size_t at) {  // each page belongs to the thread that uses it
    std::memset(from.get() + at, 1, share);
    std::memset(to.get() + at, 2, share);
  });
  double best = 0;
  for (int k = 0; k < kTries; ++k) {
    const double start = Now();
    all([&](std::size_t at) { std::memcpy(to.get() + at, from.get() + at, share); });
    best = std::max(best, 2.0 * static_cast<double>(share) * threads / (Now() - start));
  }
  return best;
}

}  // namespace grouser::dem::bench
