#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "surrogate/vehicle/solver.h"

namespace grouser::vehicle {

/// A motion on the mean ground [0] and on grounds better [1] and worse [2] by `sds` standard
/// deviations. `refine`: then all once more from there.
std::array<Solution, 3> SolveSpread(Solver* solver, const Motion& motion, double sds,
                                    const Effort* refine = nullptr);

/// The smaller and the larger; both NaN where one is, as the interval is then not known.
inline std::pair<double, double> EndsOf(double a, double b) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  if (!(a == a && b == b)) return {kNaN, kNaN};
  return {std::min(a, b), std::max(a, b)};
}

}  // namespace grouser::vehicle
