#pragma once

#include <vector>

namespace grouser::dem {

struct PlaneDisc {
  double x, y, radius;
};

/// Integrals over a region of the plane: of 1, x, y, x^2, y^2, x y.
struct PlaneMoments {
  double area = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
};

/// Of the union of discs, overlaps counted once; exact but for rounding. By
/// Green's theorem over the arcs that no other disc covers:
///   int f dA = 1/(k + 2) closed-int f (x dy - y dx)   for f of degree k.
PlaneMoments UnionMoments(const std::vector<PlaneDisc>& discs);

}  // namespace grouser::dem
