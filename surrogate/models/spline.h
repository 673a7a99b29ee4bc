#pragma once

#include <vector>

#include "surrogate/models/kinematics.h"
#include "surrogate/models/residual_table.h"

namespace grouser::surrogate {

/// How a spline goes on beyond the end of its axis: mirrored, mirrored with
/// its sign turned, or with no curvature at the end ("natural").
enum class SplineEnd { kEven, kOdd, kFree };

/// Ends that the mirrors do not fix: lateral = pi/2 and both ends of the load.
struct SplineEnds {
  SplineEnd pole = SplineEnd::kFree;
  SplineEnd load = SplineEnd::kEven;
};

/// Coordinates of the nodes, row-major (direction without its last node, which
/// is the mirror of the first; lateral; load).
struct TableNode {
  ChartPoint chart;
  double log_load;
};
std::vector<TableNode> TableNodes(const TableAxes& axes);

/// 3 x^2 - 2 x^3, 0 below x = 0 and 1 above 1.
inline double SmoothStep(double x) noexcept {
  const double t = x < 0 ? 0 : x > 1 ? 1 : x;
  return t * t * (3 - 2 * t);
}

/// Coefficients of the tensor product of uniform cubic B-splines that takes
/// `node_values` (order of TableNodes) at the nodes, with a channel's parity:
/// (direction + 3)(lateral + 3)(load + 3) numbers, as ResidualTable wants them.
///
/// Axis by axis, with the recursive filter of Unser, Aldroubi & Eden (IEEE
/// Trans. Signal Processing 41(2), 1993, 821-833) over values continued beyond
/// either end by its rule, until the filter has forgotten them (1e-16).
std::vector<double> InterpolateTable(const TableAxes& axes, ResidualTable::Parity parity,
                                     const std::vector<double>& node_values,
                                     const SplineEnds& ends = {});

}  // namespace grouser::surrogate
