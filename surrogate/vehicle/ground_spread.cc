#include "surrogate/vehicle/ground_spread.h"

#include <cstddef>

#include "surrogate/vehicle/solve_all.h"

namespace grouser::vehicle {

void SolveSpreads(Solver* solver, std::span<const Motion> motions, double sds,
                  std::span<Motion> room, std::span<Solution> out, const Effort* refine,
                  const StopWhen& stop) {
  const std::size_t n = motions.size();
  const std::size_t grounds = sds == 0 ? 1 : 3;  // without a spread both ends are the mean
  for (std::size_t k = 0; k < grounds * n; ++k) {
    room[k] = motions[k % n];
    if (k >= n) room[k].worse_by_sd += k < 2 * n ? -sds : sds;
  }
  const std::span<const Motion> asked = room.first(grounds * n);
  const std::span<Solution> found = out.first(grounds * n);
  SolveAll(solver, asked, found, stop);
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
