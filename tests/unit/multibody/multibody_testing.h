#pragma once

#include <cmath>
#include <functional>
#include <string>

#include "dem_offline/multibody/multibody.h"

// Mechanisms and measurements that the tests of joints share.

namespace grouser::dem {

inline constexpr double kG = 9.81;

/// A body of inertia (i_x, i_y, i_z) about its mass centre, which is its origin.
inline MultibodyBody Solid(const std::string& name, double mass, Vec3d inertia, Vec3d position) {
  MultibodyBody b;
  b.name = name;
  b.mass_kg = mass;
  b.inertia_kg_m2 = inertia;
  b.position_m = position;
  return b;
}

/// Time between the first and the last of n + 1 falling zero crossings of a value, over n;
/// crossings by linear interpolation.
inline double PeriodOf(MultibodySystem& system, double dt, int n,
                       const std::function<double()>& value) {
  double first = 0, before = value();
  for (int crossings = -1; crossings < n;) {
    system.Advance(dt);
    const double now = value();
    if (before > 0 && now <= 0) {
      const double at = system.time_s() - dt * now / (now - before);
      if (++crossings == 0) first = at;
      if (crossings == n) return (at - first) / n;
    }
    before = now;
  }
  return 0;
}

/// Complete elliptic integral of the first kind, by the arithmetic-geometric mean.
inline double EllipticK(double k) {
  double a = 1, b = std::sqrt(1 - k * k);
  for (int i = 0; i < 40; ++i) {
    const double mean = (a + b) / 2;
    b = std::sqrt(a * b);
    a = mean;
  }
  return M_PI / (2 * a);
}

inline Quatd TurnAbout(int axis, double angle) {
  Quatd q = {std::cos(angle / 2), 0, 0, 0};
  q[1 + axis] = std::sin(angle / 2);
  return q;
}

/// What a call says when it throws; empty when it does not.
inline std::string Message(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::exception& e) {
    return e.what();
  }
  return "";
}

}  // namespace grouser::dem
