#include "surrogate/vehicle/ground_spread.h"

#include <algorithm>
#include <cstddef>

namespace grouser::vehicle {
namespace {

constexpr int kSteps = 4;

// Of one end, better (1) or worse (2); `share` of the way to it.
double WorseAt(const Motion& motion, std::size_t end, double share, double sds) {
  return motion.worse_by_sd + (end == 1 ? -1 : 1) * share * sds;
}

// From the mean's solution to an end; leaves `out` where that does not balance.
void GoToEnd(Solver* solver, const Motion& motion, const Solution& mean, std::size_t end,
             double sds, Solution* out, const StopWhen& stop) {
  StopIfAsked(stop);
  Motion between = motion;
  Solution from = mean;
  for (int k = 1; k <= kSteps && from.balanced; ++k) {
    between.worse_by_sd = WorseAt(motion, end, double(k) / kSteps, sds);
    solver->Solve({&between, 1}, {&from, 1}, Effort{.warm = true});
  }
  if (from.balanced) *out = from;
}

}  // namespace

void SolveSpreads(Solver* solver, std::span<const Motion> motions, double sds,
                  std::span<Motion> room, std::span<Solution> out, const Effort* refine,
                  const StopWhen& stop) {
  const std::size_t n = motions.size();
  const std::size_t grounds = sds == 0 ? 1 : 3;  // without a spread both ends are the mean
  for (std::size_t k = 0; k < grounds * n; ++k) {
    room[k] = motions[k % n];
    if (k >= n) room[k].worse_by_sd = WorseAt(room[k], k / n, 1, sds);
  }
  const std::span<const Motion> asked = room.first(grounds * n);
  const std::span<Solution> found = out.first(grounds * n);
  StopIfAsked(stop);
  solver->Solve(asked, found);
  for (std::size_t k = n; k < grounds * n; ++k) {
    const Solution& mean = found[k % n];
    if (found[k].balanced || !mean.balanced || room[k].given == Motion::Given::kControls) continue;
    GoToEnd(solver, motions[k % n], mean, k / n, sds, &found[k], stop);
  }
  if (refine != nullptr) {
    StopIfAsked(stop);
    solver->Solve(asked, found, *refine);
  }
}

std::array<Solution, 3> SolveSpread(Solver* solver, const Motion& motion, double sds) {
  std::array<Motion, 3> room;
  std::array<Solution, 3> out;
  SolveSpreads(solver, {&motion, 1}, sds, room, out, nullptr, {});
  if (sds == 0) out[1] = out[2] = out[0];
  return out;
}

}  // namespace grouser::vehicle
