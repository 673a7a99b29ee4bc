#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <utility>

#include "surrogate/vehicle/solver.h"
#include "surrogate/vehicle/stop.h"

namespace grouser::vehicle {

/// Motions on the mean ground and on grounds better and worse by `sds` standard deviations:
/// solutions of all on the mean one, then of all on the better, then on the worse. `refine`: then
/// all once more from there. What is found for a motion does not depend on the others. No
/// allocation. Throws Stopped where `stop` is set, 3n solves later at most. Precondition: 3n
/// motions of room and 3n solutions.
void SolveSpreads(Solver* solver, std::span<const Motion> motions, double sds,
                  std::span<Motion> room, std::span<Solution> out, const Effort* refine,
                  const StopWhen& stop);
/// The same of one motion: on the mean ground [0], the better [1] and the worse one [2].
std::array<Solution, 3> SolveSpread(Solver* solver, const Motion& motion, double sds);

/// The smaller and the larger; both NaN where one is, as the interval is then not known.
inline std::pair<double, double> EndsOf(double a, double b) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  if (!(a == a && b == b)) return {kNaN, kNaN};
  return {std::min(a, b), std::max(a, b)};
}

}  // namespace grouser::vehicle
