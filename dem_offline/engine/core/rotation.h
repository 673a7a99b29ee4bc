#pragma once

#include <cmath>

#include "dem_offline/engine/core/vec3d.h"

// Double-precision rotations of bodies, clumps and bonds; + - x / sqrt only.

namespace grouser::dem {

GROUSER_HD Quatd Mul(const Quatd& a, const Quatd& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}
GROUSER_HD Quatd Conj(const Quatd& q) { return {q[0], -q[1], -q[2], -q[3]}; }
GROUSER_HD Quatd Unit(const Quatd& q) {
  const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return {q[0] / n, q[1] / n, q[2] / n, q[3] / n};
}

/// Rows: where the body axes' coordinates come from; world = M body.
struct Mat3d {
  double m[9];
  GROUSER_HD Vec3d operator*(const Vec3d& a) const {
    return {m[0] * a[0] + m[1] * a[1] + m[2] * a[2], m[3] * a[0] + m[4] * a[1] + m[5] * a[2],
            m[6] * a[0] + m[7] * a[1] + m[8] * a[2]};
  }
  GROUSER_HD Vec3d Back(const Vec3d& a) const {
    return {m[0] * a[0] + m[3] * a[1] + m[6] * a[2], m[1] * a[0] + m[4] * a[1] + m[7] * a[2],
            m[2] * a[0] + m[5] * a[1] + m[8] * a[2]};
  }
};
GROUSER_HD Mat3d MatrixOf(const Quatd& q) {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  return {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z),
           1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x),
           1 - 2 * (x * x + y * y)}};
}

/// Orientation after turning with world angular velocity w for dt (Cayley: the
/// angle is right to third order in w dt).
GROUSER_HD Quatd Turn(const Quatd& q, const Vec3d& w, double dt) {
  const double h = 0.5 * dt;
  return Unit(Mul({1, h * w[0], h * w[1], h * w[2]}, q));
}

/// w = R I^-1 R^T L.
GROUSER_HD Vec3d SpinOf(const Quatd& q, const Vec3d& momentum, const Vec3d& inertia) {
  const Mat3d r = MatrixOf(q);
  const Vec3d l = r.Back(momentum);
  return r * Vec3d{l[0] / inertia[0], l[1] / inertia[1], l[2] / inertia[2]};
}
GROUSER_HD Vec3d MomentumOf(const Quatd& q, const Vec3d& spin, const Vec3d& inertia) {
  const Mat3d r = MatrixOf(q);
  const Vec3d w = r.Back(spin);
  return r * Vec3d{w[0] * inertia[0], w[1] * inertia[1], w[2] * inertia[2]};
}

/// One step of a free rotation with angular momentum L (of the half step):
/// implicit midpoint in the orientation, three fixed-point rounds. Keeps L
/// exactly; second order. Returns the new orientation and the spin used.
GROUSER_HD Quatd TurnFreely(const Quatd& q, const Vec3d& momentum, const Vec3d& inertia, double dt,
                            Vec3d* spin) {
  Vec3d w = SpinOf(q, momentum, inertia);
  for (int round = 0; round < 3; ++round) w = SpinOf(Turn(q, w, 0.5 * dt), momentum, inertia);
  *spin = w;
  return Turn(q, w, dt);
}

}  // namespace grouser::dem
