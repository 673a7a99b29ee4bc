#include "surrogate/vehicle/ground_spread.h"

#include <cstddef>

namespace grouser::vehicle {

void SolveSpreads(Solver* solver, std::span<const Motion> motions, double sds,
                  std::span<Motion> room, std::span<Solution> out, const Effort* refine,
                  StopFlag stop) {
  const std::size_t n = motions.size();
  const std::size_t grounds = sds == 0 ? 1 : 3;  // without a spread both ends are the mean
  for (std::size_t k = 0; k < grounds * n; ++k) {
    room[k] = motions[k % n];
    if (k >= n) room[k].worse_by_sd += k < 2 * n ? -sds : sds;
  }
  const std::span<const Motion> asked = room.first(grounds * n);
  const std::span<Solution> found = out.first(grounds * n);
  StopIfAsked(stop);
  solver->Solve(asked, found);
  if (refine != nullptr) {
    StopIfAsked(stop);
    solver->Solve(asked, found, *refine);
  }
  for (std::size_t k = grounds * n; k < 3 * n; ++k) out[k] = out[k % n];
}

std::array<Solution, 3> SolveSpread(Solver* solver, const Motion& motion, double sds) {
  std::array<Motion, 3> room;
  std::array<Solution, 3> out;
  SolveSpreads(solver, {&motion, 1}, sds, room, out, nullptr, nullptr);
  return out;
}

}  // namespace grouser::vehicle
