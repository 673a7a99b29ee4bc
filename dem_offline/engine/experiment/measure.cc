// Bins, surface and heap out of the states of grains.
#include <algorithm>
#include <cmath>
#include <limits>

#include "dem_offline/engine/experiment/probes.h"

namespace grouser::dem::experiment {
namespace {

constexpr int kAcross = 8;  // points across a grain, of which those in the sphere share its volume

/// Points spread evenly in the unit sphere.
const std::vector<Vec3d>& SpherePoints() {
  static const std::vector<Vec3d> points = [] {
    std::vector<Vec3d> out;
    const auto at = [](int k) { return (2.0 * k + 1 - kAcross) / kAcross; };
    for (int i = 0; i < kAcross; ++i) {
      for (int j = 0; j < kAcross; ++j) {
        for (int k = 0; k < kAcross; ++k) {
          const Vec3d p = {at(i), at(j), at(k)};
          if (DotD(p, p) < 1) out.push_back(p);
        }
      }
    }
    return out;
  }();
  return points;
}

Vec3d Middle(const Region& r) { return Scale(0.5, Add(r.low_m, r.high_m)); }

/// Number of the bin of a point; -1: outside.
std::int64_t BinOf(const Probe& p, const Vec3d& x) {
  const Region& r = p.region;
  const Vec3d middle = Middle(r);
  double share[3];
  for (int k = 0; k < 3; ++k) share[k] = (x[k] - r.low_m[k]) / (r.high_m[k] - r.low_m[k]);
  if (r.radius_m > 0) {
    const double dx = x[0] - middle[0], dy = x[1] - middle[1];
    share[0] = std::hypot(dx, dy) / r.radius_m;
    const double turn = std::atan2(dy, dx) / (2 * M_PI);
    share[1] = turn < 0 ? turn + 1 : turn;
  }
  std::int64_t bin = 0;
  for (int k = 0; k < 3; ++k) {
    if (!(share[k] >= 0 && share[k] < 1)) return -1;
    bin = bin * p.n[k] +
          std::min<std::int64_t>(p.n[k] - 1, static_cast<std::int64_t>(share[k] * p.n[k]));
  }
  return bin;
}

double VolumeOf(const Probe& p, std::size_t bin) {
  const Region& r = p.region;
  const double height = (r.high_m[2] - r.low_m[2]) / p.n[2];
  if (r.radius_m > 0) {
    const auto ring = static_cast<double>(bin / p.n[2] / p.n[1]);
    const double step = r.radius_m / p.n[0];
    return M_PI * step * step * (2 * ring + 1) / p.n[1] * height;
  }
  return (r.high_m[0] - r.low_m[0]) / p.n[0] * (r.high_m[1] - r.low_m[1]) / p.n[1] * height;
}

/// In the axes of the bins: cylindrical ones see radial, along the turn, up.
Vec3d VelocityIn(const Probe& p, const GrainState& s) {
  if (!(p.region.radius_m > 0)) return {s.v_x, s.v_y, s.v_z};
  const Vec3d middle = Middle(p.region);
  const double dx = s.x_m - middle[0], dy = s.y_m - middle[1];
  const double rho = std::max(std::hypot(dx, dy), 1e-300);
  return {(s.v_x * dx + s.v_y * dy) / rho, (s.v_y * dx - s.v_x * dy) / rho, s.v_z};
}

}  // namespace

std::vector<Bin> MeasureBins(const std::vector<GrainState>& grains, const Probe& p,
                             const std::vector<double>& solid_share) {
  const auto n = static_cast<std::size_t>(p.n[0]) * p.n[1] * p.n[2];
  std::vector<Bin> bins(n);
  std::vector<double> mass(n, 0), square(n, 0);
  const auto& points = SpherePoints();
  for (std::size_t i = 0; i < grains.size(); ++i) {
    const GrainState& s = grains[i];
    const double share = (solid_share.empty() ? 1 : solid_share[i]) * 4.0 / 3 * M_PI * s.radius_m *
                         s.radius_m * s.radius_m / static_cast<double>(points.size());
    for (const Vec3d& q : points) {
      const std::int64_t bin = BinOf(p, Add({s.x_m, s.y_m, s.z_m}, Scale(s.radius_m, q)));
      if (bin >= 0) bins[bin].solid_fraction += share;
    }
    const std::int64_t bin = BinOf(p, {s.x_m, s.y_m, s.z_m});
    if (bin < 0) continue;
    const Vec3d v = VelocityIn(p, s);
    bins[bin].velocity_m_per_s = Add(bins[bin].velocity_m_per_s, Scale(s.mass_kg, v));
    bins[bin].grains += 1;
    mass[bin] += s.mass_kg;
  }
  for (std::size_t k = 0; k < n; ++k) {
    bins[k].solid_fraction /= VolumeOf(p, k);
    if (mass[k] > 0) bins[k].velocity_m_per_s = Scale(1 / mass[k], bins[k].velocity_m_per_s);
  }
  for (const GrainState& s : grains) {
    const std::int64_t bin = BinOf(p, {s.x_m, s.y_m, s.z_m});
    if (bin < 0) continue;
    const Vec3d off = Sub(VelocityIn(p, s), bins[bin].velocity_m_per_s);
    square[bin] += s.mass_kg * DotD(off, off);
  }
  for (std::size_t k = 0; k < n; ++k) {
    if (mass[k] > 0) bins[k].temperature_m2_per_s2 = square[k] / mass[k] / 3;
  }
  return bins;
}

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
  const Vec3d middle = Middle(r);
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
