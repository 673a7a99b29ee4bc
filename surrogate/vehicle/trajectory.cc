#include "surrogate/vehicle/trajectory.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace grouser::vehicle {

void TrajectoryCost::Add(int step, double lasts_s, const PowerInterval& power) {
  const Solution& s = power.solution;
  duration_s += lasts_s;
  energy.Add(power, lasts_s);
  reasons |= s.reasons;
  if (s.reasons != 0 && first_step < 0) {
    first_step = step;
    first_reasons = s.reasons;
  }
  if (!s.balanced) return;
  const std::pair<double, std::uint32_t> margins[] = {
      {s.tip_margin, kTips}, {s.torque_margin, kOverTorque}, {s.sinkage_margin, kSinksIn}};
  for (const auto& [margin, of] : margins) {
    if (least_margin_step >= 0 && !(margin < least_margin)) continue;
    least_margin = margin;
    least_margin_of = of;
    least_margin_step = step;
  }
}

void TrajectoryCost::Add(int step, const TrajectoryCost& alone) {
  duration_s += alone.duration_s;
  energy.joules += alone.energy.joules;
  energy.low += alone.energy.low;
  energy.high += alone.energy.high;
  energy.seconds += alone.energy.seconds;
  energy.metres += alone.energy.metres;
  energy.left_out += alone.energy.left_out;
  energy.left_out_s += alone.energy.left_out_s;
  reasons |= alone.reasons;
  if (alone.reasons != 0 && first_step < 0) {
    first_step = step;
    first_reasons = alone.reasons;
  }
  if (alone.least_margin_step < 0) return;
  if (least_margin_step >= 0 && !(alone.least_margin < least_margin)) return;
  least_margin = alone.least_margin;
  least_margin_of = alone.least_margin_of;
  least_margin_step = step;
}

std::vector<TrajectoryCost> TrajectoryEvaluator::CostsOf(std::span<const std::size_t> steps,
                                                         const Next& next, double sds,
                                                         const StopWhen& stop, const Tell& tell) {
  std::vector<TrajectoryCost> costs(steps.size());
  const std::size_t n = std::accumulate(steps.begin(), steps.end(), std::size_t{0});
  // Of the steps that are asked for and not told of yet, which no two batches have.
  std::array<double, PowerBatch::kMostMeans> durations;
  std::size_t asked = 0, told = 0;
  std::size_t trajectory = 0, step = 0;  // of the next power
  const auto ask = [&] {
    const TrajectoryStep s = next();
    durations[asked++ % durations.size()] = s.duration_s;
    return s.motion;
  };
  powers_.ForEach(n, sds, stop, ask, [&](const PowerInterval& power) {
    while (step == steps[trajectory]) ++trajectory, step = 0;
    costs[trajectory].Add(static_cast<int>(step++), durations[told++ % durations.size()], power);
    if (tell) tell(power);
  });
  return costs;
}

}  // namespace grouser::vehicle
