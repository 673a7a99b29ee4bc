#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <tuple>
#include <vector>

#include "dem_offline/engine/core/vec3d.h"

// Edges of triangles, and sets of faces that belong together.

namespace grouser::dem {

using Triangle = std::array<std::int32_t, 3>;

/// One edge of a face, named by its vertices in rising order.
struct FaceEdge {
  std::int32_t low, high, face;
  int edge;     ///< from corner `edge` of the face to the next
  bool rising;  ///< the face runs from low to high
  bool operator<(const FaceEdge& o) const {
    return std::tie(low, high, face, edge) < std::tie(o.low, o.high, o.face, o.edge);
  }
  bool SamePlace(const FaceEdge& o) const { return low == o.low && high == o.high; }
};

/// All edges of all faces; those of one place stand together, in the order of their faces.
inline std::vector<FaceEdge> SortedEdges(const std::vector<Triangle>& triangles) {
  std::vector<FaceEdge> out;
  out.reserve(3 * triangles.size());
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    for (int e = 0; e < 3; ++e) {
      const std::int32_t a = triangles[f][e], b = triangles[f][(e + 1) % 3];
      out.push_back({std::min(a, b), std::max(a, b), static_cast<std::int32_t>(f), e, a < b});
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

/// Calls f(first, end) for the edges of each place.
template <class F>
void ForEachPlace(const std::vector<FaceEdge>& sorted, F&& f) {
  for (auto first = sorted.begin(); first != sorted.end();) {
    auto end = first + 1;
    while (end != sorted.end() && end->SamePlace(*first)) ++end;
    f(first, end);
    first = end;
  }
}

// Disjoint sets of numbers: each starts as its own parent.

inline std::int32_t RootOf(std::vector<std::int32_t>* parent, std::int32_t i) {
  while ((*parent)[i] != i) {
    (*parent)[i] = (*parent)[(*parent)[i]];
    i = (*parent)[i];
  }
  return i;
}
/// The root of a set is its lowest member.
inline void Unite(std::vector<std::int32_t>* parent, std::int32_t a, std::int32_t b) {
  a = RootOf(parent, a);
  b = RootOf(parent, b);
  (*parent)[std::max(a, b)] = std::min(a, b);
}

/// A triangle thinner than 1e-10 (height over longest edge) has no normal, hence no area.
inline bool HasArea(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d ab = Sub(b, a), bc = Sub(c, b), ca = Sub(a, c);
  const double area = Norm(CrossD(ab, bc));
  return area > 1e-10 * std::max({DotD(ab, ab), DotD(bc, bc), DotD(ca, ca)}) && area > 1e-100;
}

}  // namespace grouser::dem
