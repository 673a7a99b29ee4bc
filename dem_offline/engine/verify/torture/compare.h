#pragma once

#include <array>

#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {

/// A turn or mirror of vectors; columns are images of x, y, z. Spins and
/// moments are axial: they get the determinant as well.
struct Transform {
  std::array<double, 9> m;
  double Determinant() const;
  Vec3d operator()(const Vec3d& a) const;
};
inline Transform Identity() { return {{1, 0, 0, 0, 1, 0, 0, 0, 1}}; }

/// Largest distance of a grain's force (and moment over radius) in `b` from
/// the transformed one in `a`, over the largest force in `a`.
double ForceDistance(const World& a, const World& b, const Transform& t);

}  // namespace grouser::dem::verify
