#include "surrogate/models/lookup.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace grouser::surrogate {
namespace {

// Well inside what the kernel answers.
constexpr double kLeastLoad = 1e-29, kMostLoad = 1e29;

}  // namespace

LookupModel::LookupModel(
    const TableAxes& axes,
    const std::array<std::span<const double>, ResponseTable::kChannels>& coefficients,
    const HullBox& box, const Uncertainty& uncertainty, const WheelGeometry& wheel)
    : TabulatedModel(Hull(box, uncertainty), wheel.radius_m), wheel_(wheel) {
  if (!(wheel.radius_m > 0) || !std::isfinite(wheel.radius_m)) {
    throw std::invalid_argument("lookup: wheel radius: expected a positive length [m]");
  }
  SetTable(ResponseTable(axes, coefficients), /*blended=*/false);
}

WheelAnswer LookupModel::OffTable(double v_x, double v_y, double rim_speed,
                                  double load) const noexcept {
  // Speeds and loads that single precision does not hold: the chart knows
  // ratios alone, and the load's own end holds beyond it.
  const double most = std::max({std::fabs(v_x), std::fabs(v_y), std::fabs(rim_speed)});
  const bool rest = most == 0;
  const double x = rest ? 1 : v_x / most, y = rest ? 0 : v_y / most;
  const double rim = rest ? 1 : rim_speed / most;
  const double bounded = std::clamp(load, kLeastLoad, kMostLoad), ratio = load / bounded;
  WheelAnswer answer;
  double value[kOutputs], high[kOutputs], fit[kOutputs], patch[kOutputs];
  ResponsesView view;
  for (int o = 0; o < kOutputs; ++o) {
    OutputView& to = view.output[o];
    to.value = {&value[o], 1};
    to.high = {&high[o], 1};
    to.sd_fit = {&fit[o], 1};
    to.sd_patch = {&patch[o], 1};
  }
  view.flags = {&answer.flags, 1};
  Evaluate({{&x, 1}, {&y, 1}, {&rim, 1}, {&bounded, 1}, {}, {}, {}, {}}, view);
  for (int o = 0; o < kOutputs; ++o) {
    const double scale = o == kSinkage ? 1 : ratio;
    answer.value[o] = scale * value[o];
    answer.half_width[o] = scale * (high[o] - value[o]);
    answer.sd_fit[o] = scale * fit[o];
    answer.sd_patch[o] = scale * patch[o];
  }
  const HullBox& box = domain().box();
  answer.flags &= ~static_cast<std::uint32_t>(kRate);
  if (!rest && box.froude_max > 0 &&
      most > std::sqrt(box.froude_max * box.gravity_m_per_s2 * wheel_.radius_m)) {
    answer.flags |= kRate;  // only magnitudes far from 1 come here
  }
  if (rest) {
    for (const Output o : {kFx, kFy, kTorque, kMz}) answer.value[o] = 0;
    answer.value[kFz] = load;
    answer.flags |= kStatic | kExtrapolated;
    domain().AddUncertainty(1 + domain().Excess(ToCanonical(1, 0, 1), load), load, &answer);
  }
  return answer;
}

}  // namespace grouser::surrogate
