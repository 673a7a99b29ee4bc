#pragma once

#include <cmath>

#include "dem_offline/engine/laws/vec3.h"

namespace grouser::dem {

/// A smooth rigid wheel: a cylinder with closed sides, given by its signed
/// distance. Pose and motion in double, in the world frame (x along the bed,
/// z up); the wheel's own x axis is turned by yaw from the world's.
struct WheelBody {
  double radius_m = 0, width_m = 0;
  double x_m = 0, y_m = 0, z_m = 0;  ///< centre
  double yaw_rad = 0;
  double v_x = 0, v_y = 0, v_z = 0;  ///< centre, world frame [m/s]
  double spin = 0;                   ///< about its own +y axis [rad/s]; r spin = rim speed
};

/// Signed distance and outward normal at a point given in the wheel frame
/// (x forward, y along the axle), exact outside; inside, the nearest face.
struct SignedDistance {
  float distance;  ///< [m], negative inside
  Vec3f normal;    ///< unit, outward
};

GROUSER_HD SignedDistance WheelDistance(float radius, float half_width, Vec3f p) {
  const float rho = Sqrt(p.x * p.x + p.z * p.z);
  const float inv = rho > 1e-12f ? 1.0f / rho : 0.0f;
  const Vec3f radial = {p.x * inv, 0.0f, p.z * inv};
  const float side = p.y >= 0.0f ? 1.0f : -1.0f;
  const float dr = rho - radius, dy = side * p.y - half_width;
  if (dr > 0.0f && dy > 0.0f) {  // nearest point is the edge of the rim
    const float d = Sqrt(dr * dr + dy * dy);
    return {d, {radial.x * (dr / d), side * (dy / d), radial.z * (dr / d)}};
  }
  if (dr > dy) return {dr, radial};
  return {dy, {0.0f, side, 0.0f}};
}

}  // namespace grouser::dem
