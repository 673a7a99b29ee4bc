#pragma once

#include "dem_offline/engine/world/parts.h"

namespace grouser::dem {

/// A body as the contact loop needs it: fixed point and float.
struct BodyView {
  std::int32_t x, y, z;
  float q[3];
  double qd[3];
  float m[9];  ///< world = M body
  bool plane;  ///< one half space through the origin: done in double
  Vec3d normal;

  BodyView(const Body& b, const WorldConfig& c) {
    const Frame& f = c.frame;
    x = f.FixX(b.position_m[0] - c.origin_m[0]);
    y = f.FixY(b.position_m[1] - c.origin_m[1]);
    z = f.FixZ(b.position_m[2] - c.origin_m[2]);
    const auto quantum = f.Quantum();
    for (int a = 0; a < 3; ++a) q[a] = quantum[a];
    qd[0] = f.length_m / 4294967296.0;
    qd[1] = f.width_m / 4294967296.0;
    qd[2] = f.z_span_m / 4294967296.0;
    const Mat3d r = MatrixOf(b.orientation);
    for (int k = 0; k < 9; ++k) m[k] = static_cast<float>(r.m[k]);
    plane = b.shape.parts.size() == 1 && b.shape.parts[0].kind == PartKind::kHalfSpace;
    if (plane) {
      const float* n = &b.shape.parts[0].axes[6];
      normal = r * Vec3d{n[0], n[1], n[2]};
      normal = Scale(1 / Norm(normal), normal);
    }
  }
  Vec3f Relative(const Grain& g) const {  // world axes [m]
    return {static_cast<float>(WrapDiff(g.x, x)) * q[0],
            static_cast<float>(WrapDiff(g.y, y)) * q[1],
            static_cast<float>(WrapDiff(g.z, z)) * q[2]};
  }
  Vec3f ToBody(Vec3f a) const {
    return {m[0] * a.x + m[3] * a.y + m[6] * a.z, m[1] * a.x + m[4] * a.y + m[7] * a.z,
            m[2] * a.x + m[5] * a.y + m[8] * a.z};
  }
  Vec3f ToWorld(Vec3f a) const {
    return {m[0] * a.x + m[1] * a.y + m[2] * a.z, m[3] * a.x + m[4] * a.y + m[5] * a.z,
            m[6] * a.x + m[7] * a.y + m[8] * a.z};
  }
  float PlaneDistance(const Grain& g) const {
    return static_cast<float>(WrapDiff(g.x, x) * (qd[0] * normal[0]) +
                              WrapDiff(g.y, y) * (qd[1] * normal[1]) +
                              WrapDiff(g.z, z) * (qd[2] * normal[2]));
  }
  Vec3f PlaneNormal() const {
    return {static_cast<float>(normal[0]), static_cast<float>(normal[1]),
            static_cast<float>(normal[2])};
  }
};

}  // namespace grouser::dem
