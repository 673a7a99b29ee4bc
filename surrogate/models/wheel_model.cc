#include "surrogate/models/wheel_model.h"

#include <limits>

namespace grouser::surrogate {
namespace {

template <class T>
std::span<T> CutSpan(std::span<T> all, std::size_t first, std::size_t count) {
  return all.empty() ? all : all.subspan(first, count);
}

}  // namespace

WheelStatesView Cut(const WheelStatesView& in, std::size_t first, std::size_t count) noexcept {
  return {CutSpan(in.v_x, first, count),         CutSpan(in.v_y, first, count),
          CutSpan(in.rim_speed, first, count),   CutSpan(in.load, first, count),
          CutSpan(in.slope_pitch, first, count), CutSpan(in.slope_roll, first, count),
          CutSpan(in.yaw_rate, first, count),    CutSpan(in.pass_number, first, count)};
}

ResponsesView Cut(const ResponsesView& out, std::size_t first, std::size_t count) noexcept {
  ResponsesView cut;
  for (int o = 0; o < kOutputs; ++o) {
    for (const auto part : kPartMembers) {
      cut.output[o].*part = CutSpan(out.output[o].*part, first, count);
    }
    cut.output[o].sd_soil = CutSpan(out.output[o].sd_soil, first, count);
  }
  cut.flags = CutSpan(out.flags, first, count);
  cut.slip = CutSpan(out.slip, first, count);
  cut.attack_angle = CutSpan(out.attack_angle, first, count);
  return cut;
}

void WriteAirborne(const ResponsesView& out, std::size_t i) noexcept {
  out.flags[i] = kAirborne;
  for (const OutputView& o : out.output) {
    for (const auto part : kPartMembers) {
      const std::span<double> to = o.*part;
      if (!to.empty()) to[i] = 0;
    }
  }
}

WheelAnswer AnswerOf(const WheelModel& model, const VelocityState& motion, double load) noexcept {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  WheelAnswer answer{};
  std::array<double, kOutputs> high;
  for (auto* part : {&answer.value, &answer.sd_fit, &answer.sd_patch, &high}) part->fill(kNaN);
  ResponsesView out;
  for (int o = 0; o < kOutputs; ++o) {
    out.output[o].value = {&answer.value[o], 1};
    out.output[o].sd_fit = {&answer.sd_fit[o], 1};
    out.output[o].sd_patch = {&answer.sd_patch[o], 1};
    out.output[o].high = {&high[o], 1};
  }
  out.flags = {&answer.flags, 1};
  model.Evaluate(
      {{&motion.v_x, 1}, {&motion.v_y, 1}, {&motion.rim_speed, 1}, {&load, 1}, {}, {}, {}, {}},
      out);
  for (int o = 0; o < kOutputs; ++o) answer.half_width[o] = high[o] - answer.value[o];
  return answer;
}

}  // namespace grouser::surrogate
