#include "surrogate/models/lookup.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace grouser::surrogate {
namespace {

// Well inside what the kernel answers.
constexpr double kLeastLoad = 1e-29, kMostLoad = 1e29;
constexpr double kLeastSpeed = 1e-90, kMostSpeed = 1e90;

}  // namespace

LookupModel::LookupModel(
    const TableAxes& axes,
    const std::array<std::span<const double>, ResponseTable::kChannels>& coefficients,
    const TrainingDomain& box, const Uncertainty& uncertainty, const WheelGeometry& wheel,
    const SpeedAxis& speed,
    const std::array<std::span<const double>, ResponseTable::kChannels>& rate)
    : TabulatedModel(Hull(box, uncertainty), wheel.radius_m), wheel_(wheel) {
  if (!(wheel.radius_m > 0) || !std::isfinite(wheel.radius_m)) {
    throw std::invalid_argument("lookup: wheel radius: expected a positive length [m]");
  }
  ResponseTable table(axes, coefficients);
  if (speed.present()) {
    CheckSpeedAxis(speed, axes, axes);
    table.AddSpeed(speed, rate);
  }
  SetTable(std::move(table), /*blended=*/false);
}

WheelAnswer LookupModel::OffTable(double v_x, double v_y, double rim_speed,
                                  double load) const noexcept {
  // Magnitudes that the kernel does not hold: the chart knows ratios of speeds
  // alone, and beyond an end of the load or speed axis that end holds.
  const double most = std::max({std::fabs(v_x), std::fabs(v_y), std::fabs(rim_speed)});
  const bool rest = most == 0;
  const double speed = std::clamp(most, kLeastSpeed, kMostSpeed);
  const double x = rest ? speed : v_x / most * speed, y = rest ? 0 : v_y / most * speed;
  const double rim = rest ? speed : rim_speed / most * speed;
  const double bounded = std::clamp(load, kLeastLoad, kMostLoad), ratio = load / bounded;
  WheelAnswer answer = AnswerOf(*this, {x, y, rim}, bounded);
  for (int o = 0; o < kOutputs; ++o) {
    const double scale = o == kSinkage ? 1 : ratio;
    for (auto* part : {&answer.value, &answer.half_width, &answer.sd_fit, &answer.sd_patch}) {
      (*part)[o] *= scale;
    }
  }
  if (rest) {
    for (const Output o : {kFx, kFy, kTorque, kMz}) answer.value[o] = 0;
    answer.value[kFz] = load;
    answer.flags |= kStatic | kExtrapolated;
    const double excess = domain().Excess(ToCanonical(speed, 0, speed), load, wheel_.radius_m);
    domain().AddUncertainty(1 + excess, 0, load, &answer);
  }
  return answer;
}

}  // namespace grouser::surrogate
