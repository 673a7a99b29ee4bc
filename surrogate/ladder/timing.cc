#include "surrogate/ladder/timing.h"

#include <algorithm>
#include <chrono>
#include <random>
#include <span>

namespace grouser::surrogate {
namespace {

constexpr std::size_t kBatch = 10000;

/// A batch of states in structure-of-arrays form, and room for the answers.
class Batch {
 public:
  explicit Batch(std::size_t n)
      : v_x(n), v_y(n), rim(n), load(n), flags(n), out(4 * kOutputs * n) {}
  void Set(std::size_t i, const VelocityState& v, double load_n) {
    v_x[i] = v.v_x;
    v_y[i] = v.v_y;
    rim[i] = v.rim_speed;
    load[i] = load_n;
  }
  void Run(const WheelModel& model) {
    WheelStatesView in;
    in.v_x = v_x;
    in.v_y = v_y;
    in.rim_speed = rim;
    in.load = load;
    ResponsesView to;
    for (int o = 0; o < kOutputs; ++o) {
      to.output[o].value = Part(o, 0);
      to.output[o].sd_fit = Part(o, 1);
      to.output[o].low = Part(o, 2);
      to.output[o].high = Part(o, 3);
    }
    to.flags = flags;
    model.Evaluate(in, to);
  }
  std::span<double> Part(int output, int part) {
    const std::size_t n = load.size();
    return std::span<double>(out).subspan((static_cast<std::size_t>(output) * 4 + part) * n, n);
  }

 private:
  std::vector<double> v_x, v_y, rim, load;
  std::vector<std::uint32_t> flags;
  std::vector<double> out;
};

double SecondsOf(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
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

double TimeOfModel(const WheelModel& model, const std::vector<Row>& states, double seconds) {
  Batch batch(kBatch);
  std::mt19937_64 random(1);
  for (std::size_t i = 0; i < kBatch; ++i) {
    const Row& row = states[random() % states.size()];
    batch.Set(i, row.motion, row.load_n);
  }
  return TimeOf([&] { batch.Run(model); }, kBatch, seconds);
}

Answer AnswerOf(const WheelModel& model, const VelocityState& motion, double load) {
  Batch one(1);
  one.Set(0, motion, load);
  one.Run(model);
  Answer a;
  for (int o = 0; o < kOutputs; ++o) {
    a.value[o] = one.Part(o, 0)[0];
    a.half_width[o] = 0.5 * (one.Part(o, 3)[0] - one.Part(o, 2)[0]);
  }
  return a;
}

}  // namespace grouser::surrogate
