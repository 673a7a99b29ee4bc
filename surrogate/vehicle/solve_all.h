#pragma once

#include <cstddef>
#include <span>

#include "surrogate/vehicle/solver.h"
#include "surrogate/vehicle/stop.h"

namespace grouser::vehicle {

/// What solver->Solve(motions, out) finds, bit for bit; `stop` is asked before the batch and before
/// each motion that has to be followed from others (120 solves at most).
inline void SolveAll(Solver* solver, std::span<const Motion> motions, std::span<Solution> out,
                     const StopWhen& stop) {
  StopIfAsked(stop);
  solver->Solve(motions, out, Effort{});
  for (std::size_t k = 0; k < motions.size(); ++k) {
    if (out[k].balanced) continue;
    StopIfAsked(stop);
    solver->Follow(motions[k], &out[k]);
  }
}

}  // namespace grouser::vehicle
