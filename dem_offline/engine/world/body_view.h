#pragma once

#include "dem_offline/engine/core/frame.h"
#include "dem_offline/engine/core/grain.h"
#include "dem_offline/engine/world/rigid_body.h"

namespace grouser::dem {

/// A body as the contact loop needs it: fixed point and float.
struct BodyView {
  std::int32_t x, y, z;
  float q[3];
  double qd[3];
  float m[9];  ///< world = M body
  bool plane;  ///< one half space through the origin: done in double
  Vec3d normal;

  BodyView() = default;
  /// half_space: its plane, or null. origin: of the frame.
  GROUSER_HD BodyView(const RigidBody& b, const Part* half_space, const Frame& f,
                      const Vec3d& origin_m) {
    x = WrapFix(b.position_m[0] - origin_m[0], f.length_m);
    y = WrapFix(b.position_m[1] - origin_m[1], f.width_m);
    z = SpanFix(b.position_m[2] - origin_m[2], f.z_span_m);
    qd[0] = f.length_m / 4294967296.0;
    qd[1] = f.width_m / 4294967296.0;
    qd[2] = f.z_span_m / 4294967296.0;
    for (int a = 0; a < 3; ++a) q[a] = static_cast<float>(qd[a]);
    const Mat3d r = MatrixOf(b.orientation);
    for (int k = 0; k < 9; ++k) m[k] = static_cast<float>(r.m[k]);
    plane = half_space != nullptr;
    if (plane) {
      const float* n = &half_space->axes[6];
      normal = r * Vec3d{n[0], n[1], n[2]};
      normal = Scale(1 / Norm(normal), normal);
    }
  }
  GROUSER_HD Vec3f Relative(const Grain& g) const {  // world axes [m]
    return {static_cast<float>(WrapDiff(g.x, x)) * q[0],
            static_cast<float>(WrapDiff(g.y, y)) * q[1],
            static_cast<float>(WrapDiff(g.z, z)) * q[2]};
  }
  GROUSER_HD Vec3f ToBody(Vec3f a) const {
    return {m[0] * a.x + m[3] * a.y + m[6] * a.z, m[1] * a.x + m[4] * a.y + m[7] * a.z,
            m[2] * a.x + m[5] * a.y + m[8] * a.z};
  }
  GROUSER_HD Vec3f ToWorld(Vec3f a) const {
    return {m[0] * a.x + m[1] * a.y + m[2] * a.z, m[3] * a.x + m[4] * a.y + m[5] * a.z,
            m[6] * a.x + m[7] * a.y + m[8] * a.z};
  }
  GROUSER_HD float PlaneDistance(const Grain& g) const {
    return static_cast<float>(WrapDiff(g.x, x) * (qd[0] * normal[0]) +
                              WrapDiff(g.y, y) * (qd[1] * normal[1]) +
                              WrapDiff(g.z, z) * (qd[2] * normal[2]));
  }
  GROUSER_HD Vec3f PlaneNormal() const {
    return {static_cast<float>(normal[0]), static_cast<float>(normal[1]),
            static_cast<float>(normal[2])};
  }
};

/// The plane of a shape that is one half space; null: another shape.
GROUSER_HD const Part* PlaneOf(const Part* parts, int count) {
  return count == 1 && parts[0].kind == PartKind::kHalfSpace ? parts : nullptr;
}

}  // namespace grouser::dem
