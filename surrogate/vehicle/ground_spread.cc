#include "surrogate/vehicle/ground_spread.h"

#include <cstddef>

namespace grouser::vehicle {

std::array<Solution, 3> SolveSpread(Solver* solver, const Motion& motion, double sds,
                                    const Effort* refine) {
  constexpr int kSteps = 4;
  std::array<Motion, 3> motions = {motion, motion, motion};
  std::array<Solution, 3> solutions;
  const auto at = [&](std::size_t end, double share) {
    return motion.worse_by_sd + (end == 1 ? -1 : 1) * share * sds;
  };
  motions[1].worse_by_sd = at(1, 1);
  motions[2].worse_by_sd = at(2, 1);
  solver->Solve(motions, solutions);
  for (std::size_t end = 1; end < 3; ++end) {
    if (solutions[end].balanced || !solutions[0].balanced ||
        motion.given == Motion::Given::kControls) {
      continue;
    }
    Motion between = motion;
    Solution from = solutions[0];
    for (int k = 1; k <= kSteps && from.balanced; ++k) {
      between.worse_by_sd = at(end, double(k) / kSteps);
      solver->Solve({&between, 1}, {&from, 1}, Effort{.warm = true});
    }
    if (from.balanced) solutions[end] = from;
  }
  if (refine != nullptr) solver->Solve(motions, solutions, *refine);
  return solutions;
}

}  // namespace grouser::vehicle
