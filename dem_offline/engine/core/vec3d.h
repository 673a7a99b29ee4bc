#pragma once

#include <array>
#include <cmath>

#include "dem_offline/engine/core/vec3.h"

// Vectors in double, for bodies, clumps and bonds; + - x / sqrt only. (nvcc takes
// std::array with --expt-relaxed-constexpr.)

namespace grouser::dem {

using Vec3d = std::array<double, 3>;
using Quatd = std::array<double, 4>;  ///< w, x, y, z; body to world

GROUSER_HD Vec3d Add(const Vec3d& a, const Vec3d& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
GROUSER_HD Vec3d Sub(const Vec3d& a, const Vec3d& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
GROUSER_HD Vec3d Scale(double s, const Vec3d& a) { return {s * a[0], s * a[1], s * a[2]}; }
GROUSER_HD double DotD(const Vec3d& a, const Vec3d& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
GROUSER_HD Vec3d CrossD(const Vec3d& a, const Vec3d& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
GROUSER_HD Vec3f ToFloat(const Vec3d& a) {
  return {static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(a[2])};
}
GROUSER_HD double Norm(const Vec3d& a) { return std::sqrt(DotD(a, a)); }

}  // namespace grouser::dem
