#include "surrogate/models/state_batch.h"

#include <limits>

namespace grouser::surrogate {

StateBatch::StateBatch(std::size_t n, std::initializer_list<Part> parts)
    : v_x(n), v_y(n), rim_speed(n), load(n), flags(n, ~std::uint32_t{0}) {
  for (auto& output : part) {
    for (const Part p : parts) output[p].assign(n, std::numeric_limits<double>::quiet_NaN());
  }
}

StateBatch::StateBatch(std::size_t n)
    : StateBatch(n, {kValue, kSdFit, kSdPatch, kLow, kHigh, kDvX, kDvY, kDRim, kDLoad}) {
  slip = attack_angle = part[kFx][kValue];
}

WheelStatesView StateBatch::In(std::size_t first, std::size_t count) const {
  return Cut(
      WheelStatesView{v_x, v_y, rim_speed, load, slope_pitch, slope_roll, yaw_rate, pass_number},
      first, count);
}

ResponsesView StateBatch::Out(std::size_t first, std::size_t count) {
  ResponsesView view;
  for (int o = 0; o < kOutputs; ++o) {
    for (int p = 0; p < kParts; ++p) view.output[o].*kPartMembers[p] = part[o][p];
  }
  view.flags = flags;
  view.slip = slip;
  view.attack_angle = attack_angle;
  return Cut(view, first, count);
}

}  // namespace grouser::surrogate
