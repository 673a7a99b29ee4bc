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

std::vector<TrajectoryCost> TrajectoryEvaluator::CostsOf(std::span<const std::size_t> steps,
                                                         const Next& next, double sds,
                                                         StopFlag stop, const Tell& tell) {
  std::vector<TrajectoryCost> costs(steps.size());
  const std::size_t n = std::accumulate(steps.begin(), steps.end(), std::size_t{0});
  std::array<Motion, PowerBatch::kMost> motions;
  std::array<double, PowerBatch::kMost> durations;
  std::size_t trajectory = 0, step = 0;  // of the next power
  for (std::size_t first = 0; first < n; first += PowerBatch::kMost) {
    const std::size_t some = std::min(PowerBatch::kMost, n - first);
    for (std::size_t k = 0; k < some; ++k) {
      const TrajectoryStep s = next();
      motions[k] = s.motion;
      durations[k] = s.duration_s;
    }
    const std::span<const PowerInterval> powers =
        powers_.Of(std::span(motions).first(some), sds, stop);
    for (std::size_t k = 0; k < some; ++k) {
      while (step == steps[trajectory]) ++trajectory, step = 0;
      costs[trajectory].Add(static_cast<int>(step++), durations[k], powers[k]);
      if (tell) tell(powers[k]);
    }
  }
  return costs;
}

}  // namespace grouser::vehicle
