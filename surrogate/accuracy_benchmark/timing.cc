#include "surrogate/accuracy_benchmark/timing.h"

#include <algorithm>
#include <ctime>
#include <random>

#include "surrogate/models/state_batch.h"

namespace grouser::surrogate {
namespace {

constexpr std::size_t kBatch = 10000;

// Of this process alone: what else the machine does hardly shows.
double ProcessorSeconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double SecondsOf(const std::function<void()>& work) {
  const double begin = ProcessorSeconds();
  work();
  return ProcessorSeconds() - begin;
}

}  // namespace

double TimeOf(const std::function<void()>& call, double n, double seconds) {
  call();
  std::vector<double> times;
  for (double spent = 0; spent < seconds || times.size() < 3;) {
    times.push_back(SecondsOf(call));
    spent += times.back();
  }
  std::nth_element(times.begin(), times.begin() + times.size() / 2, times.end());
  return times[times.size() / 2] / n * 1e9;
}

double TimeOfModel(const WheelModel& model, const std::vector<Sample>& states, double seconds) {
  StateBatch batch(kBatch, {kValue, kSdFit, kLow, kHigh});
  std::mt19937_64 random(1);
  for (std::size_t i = 0; i < kBatch; ++i) {
    const Sample& row = states[random() % states.size()];
    batch.Set(i, row.motion, row.load_n);
  }
  return TimeOf([&] { model.Evaluate(batch.In(), batch.Out()); }, kBatch, seconds);
}

}  // namespace grouser::surrogate
