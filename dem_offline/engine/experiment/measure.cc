// Surface and heap out of the states of grains.
#include <algorithm>
#include <cmath>
#include <limits>

#include "dem_offline/engine/experiment/probes.h"

namespace grouser::dem::experiment {

std::vector<double> MeasureSurface(const std::vector<GrainState>& grains, const Probe& p) {
  const Region& r = p.region;
  std::vector<double> out(static_cast<std::size_t>(p.n[0]) * p.n[1],
                          std::numeric_limits<double>::quiet_NaN());
  const double dx = (r.high_m[0] - r.low_m[0]) / p.n[0], dy = (r.high_m[1] - r.low_m[1]) / p.n[1];
  for (const GrainState& s : grains) {
    // Every field whose middle lies under the grain sees its cap.
    const auto first = [&](double x, double low, double step) {
      return std::max(0, static_cast<int>(std::ceil((x - s.radius_m - low) / step - 0.5)));
    };
    const auto last = [&](double x, double low, double step, int n) {
      return std::min(n - 1, static_cast<int>(std::floor((x + s.radius_m - low) / step - 0.5)));
    };
    for (int ix = first(s.x_m, r.low_m[0], dx); ix <= last(s.x_m, r.low_m[0], dx, p.n[0]); ++ix) {
      for (int iy = first(s.y_m, r.low_m[1], dy); iy <= last(s.y_m, r.low_m[1], dy, p.n[1]); ++iy) {
        const double ax = r.low_m[0] + (ix + 0.5) * dx - s.x_m,
                     ay = r.low_m[1] + (iy + 0.5) * dy - s.y_m;
        const double cap = s.radius_m * s.radius_m - ax * ax - ay * ay;
        if (!(cap >= 0)) continue;
        double& height = out[static_cast<std::size_t>(ix) * p.n[1] + iy];
        const double z = s.z_m + std::sqrt(cap);
        if (!(height >= z)) height = z;
      }
    }
  }
  return out;
}

Heap MeasureHeap(const std::vector<GrainState>& grains, const Probe& p, double diameter_m) {
  static constexpr int kSectors = 16;
  const Region& r = p.region;
  const Vec3d middle = Scale(0.5, Add(r.low_m, r.high_m));
  const double reach = 0.5 * std::min(r.high_m[0] - r.low_m[0], r.high_m[1] - r.low_m[1]);
  const int rings = static_cast<int>(std::min(1e4, reach / diameter_m));
  Heap out;
  if (rings < 4) return out;
  // Sectors are two diameters wide or more, so that a full layer has a grain in each.
  const auto sectors = [](int ring) {
    return std::clamp(static_cast<int>(M_PI * (ring + 0.5)), 1, kSectors);
  };
  std::vector<double> top(static_cast<std::size_t>(rings) * kSectors, 0);
  for (const GrainState& s : grains) {
    const double dx = s.x_m - middle[0], dy = s.y_m - middle[1];
    const double ring_of = std::hypot(dx, dy) / diameter_m;
    if (!(ring_of < rings)) continue;
    const int ring = static_cast<int>(ring_of), n = sectors(ring);
    const double turn = std::atan2(dy, dx) / (2 * M_PI);
    const int sector = std::min(n - 1, static_cast<int>((turn < 0 ? turn + 1 : turn) * n));
    double& t = top[static_cast<std::size_t>(ring) * kSectors + sector];
    t = std::max(t, s.z_m + s.radius_m - r.low_m[2]);
    out.height_m = std::max(out.height_m, s.z_m + s.radius_m - r.low_m[2]);
  }
  std::vector<double> mean(rings, 0);
  int foot = rings;
  for (int k = 0; k < rings; ++k) {
    for (int s = 0; s < sectors(k); ++s) {
      mean[k] += top[static_cast<std::size_t>(k) * kSectors + s] / sectors(k);
    }
    if (mean[k] < diameter_m && k > 0) {
      foot = k;
      break;
    }
  }
  out.foot_m = foot * diameter_m;
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  const double summit = *std::max_element(mean.begin() + 1, mean.end());
  for (int k = 1; k < foot; ++k) {
    const double x = (k + 0.5) * diameter_m;
    if (mean[k] < 0.2 * summit || mean[k] > 0.8 * summit) continue;
    n += 1, sx += x, sy += mean[k], sxx += x * x, sxy += x * mean[k];
  }
  if (n >= 2) out.angle_rad = std::atan(-(n * sxy - sx * sy) / (n * sxx - sx * sx));
  return out;
}

}  // namespace grouser::dem::experiment
