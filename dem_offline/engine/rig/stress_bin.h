#pragma once

#include <cmath>

#include "dem_offline/engine/core/vec3.h"

namespace grouser::dem {

/// Bins of the rim by angle (from straight down, forward positive) and across
/// its width.
struct StressGrid {
  int angles = 0, widths = 0;
  double step_rad = 0, width_m = 0;
  float cos_yaw = 1, sin_yaw = 0;  ///< of the wheel's x axis from the world's
  int bins() const { return angles * widths; }
};

/// Where a contact on the rim counts, and its force on the ground's side: along
/// the inward normal, along the rim, and along the axle [N].
struct StressPart {
  int bin;
  double normal, tangential, axial;
};

/// sums: [bins x 3] of forces [N].
GROUSER_HD void AddTo(double* sums, const StressPart& part) {
  sums[3 * part.bin] += part.normal;
  sums[3 * part.bin + 1] += part.tangential;
  sums[3 * part.bin + 2] += part.axial;
}

/// point: from the hub, force: on the wheel, both in world axes.
GROUSER_HD StressPart StressOf(const StressGrid& g, Vec3f point_m, Vec3f force_n) {
  constexpr double kPi = 3.14159265358979323846;
  const float cy = g.cos_yaw, sy = g.sin_yaw;
  const Vec3f point = {cy * point_m.x + sy * point_m.y, -sy * point_m.x + cy * point_m.y,
                       point_m.z};
  const Vec3f f = {cy * force_n.x + sy * force_n.y, -sy * force_n.x + cy * force_n.y, force_n.z};
  const double angle = atan2(static_cast<double>(point.x), static_cast<double>(-point.z));
  const auto within = [](int k, int n) { return k < 0 ? 0 : (k >= n ? n - 1 : k); };
  const int a = within(static_cast<int>((angle + kPi) / g.step_rad), g.angles);
  const double across = point.y / g.width_m + 0.5;
  const int w = within(static_cast<int>(across * g.widths), g.widths);
  const double s = sin(angle), k = cos(angle);
  return {a * g.widths + w, -(f.x * s - f.z * k), f.x * k + f.z * s, static_cast<double>(f.y)};
}

}  // namespace grouser::dem
