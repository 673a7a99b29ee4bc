#include "surrogate/vehicle/ground_spread.h"

namespace grouser::vehicle {

std::array<Solution, 3> SolveSpread(Solver* solver, const Motion& motion, double sds,
                                    const Effort* refine) {
  std::array<Motion, 3> motions = {motion, motion, motion};
  std::array<Solution, 3> solutions;
  motions[1].worse_by_sd -= sds;
  motions[2].worse_by_sd += sds;
  solver->Solve(motions, solutions);
  if (refine != nullptr) solver->Solve(motions, solutions, *refine);
  return solutions;
}

}  // namespace grouser::vehicle
