// Bins out of the states of grains.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "dem_offline/engine/experiment/probes.h"

namespace grouser::dem::experiment {
namespace {

constexpr int kAcross = 8;  // points across a grain, of which those in the sphere share its volume

/// Points spread evenly in the unit sphere, or in its disc of y = 0.
std::vector<Vec3d> PointsIn(bool disc) {
  std::vector<Vec3d> out;
  const auto at = [](int k) { return (2.0 * k + 1 - kAcross) / kAcross; };
  for (int i = 0; i < kAcross; ++i) {
    for (int j = 0; j < (disc ? 1 : kAcross); ++j) {
      for (int k = 0; k < kAcross; ++k) {
        const Vec3d p = {at(i), disc ? 0 : at(j), at(k)};
        if (DotD(p, p) < 1) out.push_back(p);
      }
    }
  }
  return out;
}
const std::vector<Vec3d>& GrainPoints(bool planar) {
  static const std::vector<Vec3d> sphere = PointsIn(false), disc = PointsIn(true);
  return planar ? disc : sphere;
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

/// Of planar bins: their area in the plane.
double VolumeOf(const Probe& p, std::size_t bin, bool planar) {
  const Region& r = p.region;
  const double height = (r.high_m[2] - r.low_m[2]) / p.n[2];
  if (planar) return (r.high_m[0] - r.low_m[0]) / p.n[0] * height;
  if (r.radius_m > 0) {
    const auto ring = static_cast<double>(bin / p.n[2] / p.n[1]);
    const double step = r.radius_m / p.n[0];
    return M_PI * step * step * (2 * ring + 1) / p.n[1] * height;
  }
  return (r.high_m[0] - r.low_m[0]) / p.n[0] * (r.high_m[1] - r.low_m[1]) / p.n[1] * height;
}

/// Axes of the bins at a point, as rows: cylindrical ones are radial, along the turn, up.
std::array<Vec3d, 3> AxesAt(const Probe& p, const GrainState& s) {
  if (!(p.region.radius_m > 0)) return {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
  const Vec3d middle = Middle(p.region);
  const double dx = s.x_m - middle[0], dy = s.y_m - middle[1];
  const double rho = std::max(std::hypot(dx, dy), 1e-300);
  return {Vec3d{dx / rho, dy / rho, 0}, Vec3d{-dy / rho, dx / rho, 0}, Vec3d{0, 0, 1}};
}

Vec3d In(const std::array<Vec3d, 3>& axes, const Vec3d& v) {
  return {DotD(axes[0], v), DotD(axes[1], v), DotD(axes[2], v)};
}

/// A symmetric tensor (xx, yy, zz, xy, xz, yz) in other axes.
ContactMoment In(const std::array<Vec3d, 3>& axes, const ContactMoment& m) {
  const std::array<Vec3d, 3> rows = {Vec3d{m[0], m[3], m[4]}, Vec3d{m[3], m[1], m[5]},
                                     Vec3d{m[4], m[5], m[2]}};
  const auto at = [&](int i, int j) { return DotD(axes[i], In(rows, axes[j])); };
  return {at(0, 0), at(1, 1), at(2, 2), at(0, 1), at(0, 2), at(1, 2)};
}

Vec3d VelocityIn(const Probe& p, const GrainState& s) {
  return In(AxesAt(p, s), Vec3d{s.v_x, s.v_y, s.v_z});
}

}  // namespace

std::vector<Bin> MeasureBins(const BinnedGrains& all, const Probe& p) {
  const auto n = static_cast<std::size_t>(p.n[0]) * p.n[1] * p.n[2];
  std::vector<Bin> bins(n);
  std::vector<double> mass(n, 0), square(n, 0), moved(n, 0);
  const auto& points = GrainPoints(all.planar);
  const double each = 1.0 / static_cast<double>(points.size());
  for (std::size_t i = 0; i < all.states.size(); ++i) {
    const GrainState& s = all.states[i];
    const auto axes = AxesAt(p, s);
    const double size = all.planar ? M_PI * s.radius_m * s.radius_m
                                   : 4.0 / 3 * M_PI * s.radius_m * s.radius_m * s.radius_m;
    const double share = (all.solid_share.empty() ? 1 : all.solid_share[i]) * size * each;
    const ContactMoment moment = all.moments.empty() ? ContactMoment{} : In(axes, all.moments[i]);
    for (const Vec3d& q : points) {
      const std::int64_t bin = BinOf(p, Add({s.x_m, s.y_m, s.z_m}, Scale(s.radius_m, q)));
      if (bin < 0) continue;
      bins[bin].solid_fraction += share;
      for (int k = 0; k < 6; ++k) bins[bin].stress_pa[k] += each * moment[k];
    }
    const std::int64_t bin = BinOf(p, {s.x_m, s.y_m, s.z_m});
    if (bin < 0) continue;
    Bin& b = bins[bin];
    b.velocity_m_per_s =
        Add(b.velocity_m_per_s, Scale(s.mass_kg, In(axes, Vec3d{s.v_x, s.v_y, s.v_z})));
    b.grains += 1;
    mass[bin] += s.mass_kg;
    if (all.displacement_m.empty() || std::isnan(all.displacement_m[i][0])) continue;
    b.displacement_m = Add(b.displacement_m, In(axes, all.displacement_m[i]));
    moved[bin] += 1;
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 0; k < n; ++k) {
    Bin& b = bins[k];
    b.solid_fraction /= VolumeOf(p, k, all.planar);
    for (double& stress : b.stress_pa)
      stress = all.moments.empty() ? nan : stress / VolumeOf(p, k, all.planar);
    if (mass[k] > 0) b.velocity_m_per_s = Scale(1 / mass[k], b.velocity_m_per_s);
    b.displacement_m = moved[k] > 0 ? Scale(1 / moved[k], b.displacement_m) : Vec3d{nan, nan, nan};
  }
  for (const GrainState& s : all.states) {
    const std::int64_t bin = BinOf(p, {s.x_m, s.y_m, s.z_m});
    if (bin < 0) continue;
    const Vec3d off = Sub(VelocityIn(p, s), bins[bin].velocity_m_per_s);
    square[bin] += s.mass_kg * DotD(off, off);
  }
  for (std::size_t k = 0; k < n; ++k) {
    if (mass[k] > 0) bins[k].temperature_m2_per_s2 = square[k] / mass[k] / (all.planar ? 2 : 3);
  }
  return bins;
}

/// By way of the shortest image of a periodic side; NaN where a grain came later.
BinnedGrains Probes::Binned() const {
  const World& world = ground_.world();
  BinnedGrains out;
  out.states = States();
  out.planar = e_.box.planar;
  if (world.state().bonds.empty() && !out.planar) out.moments = world.ContactMoments();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto shortest = [](double d, double side, Side kind) {
    return kind == Side::kPeriodic ? d - side * std::round(d / side) : d;
  };
  const bool window = !e_.box.follow.body.empty();
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const GrainState& s = out.states[i];
    const auto id = static_cast<std::size_t>(world.grains()[i].id);
    out.solid_share.push_back(ground_.SolidShare(i));
    Vec3d d = {nan, nan, nan};
    if (id < start_m_.size()) d = Sub({s.x_m, s.y_m, s.z_m}, start_m_[id]);
    if (!window) d[0] = shortest(d[0], e_.box.length_m, e_.box.x);
    d[1] = shortest(d[1], e_.box.width_m, e_.box.y);
    out.displacement_m.push_back(d);
  }
  return out;
}

void Probes::WriteBins(const Probe& p, const Probe& here, double time_s) {
  const Region& r = here.region;
  const std::vector<Bin> bins = MeasureBins(Binned(), here);
  const bool round = r.radius_m > 0;
  const double low[3] = {round ? 0 : r.low_m[0], round ? 0 : r.low_m[1], r.low_m[2]};
  const double high[3] = {round ? r.radius_m : r.high_m[0], round ? 2 * M_PI : r.high_m[1],
                          r.high_m[2]};
  for (std::size_t k = 0; k < bins.size(); ++k) {
    const std::size_t at[3] = {k / p.n[2] / p.n[1], k / p.n[2] % p.n[1], k % p.n[2]};
    std::vector<double> row = {time_s};
    for (int a = 0; a < 3; ++a) {
      const double step = (high[a] - low[a]) / p.n[a];
      row.push_back(low[a] + static_cast<double>(at[a]) * step);
      row.push_back(low[a] + static_cast<double>(at[a] + 1) * step);
    }
    const Bin& b = bins[k];
    row.push_back(b.solid_fraction);
    row.insert(row.end(), b.velocity_m_per_s.begin(), b.velocity_m_per_s.end());
    row.insert(row.end(), {b.temperature_m2_per_s2, b.grains});
    row.insert(row.end(), b.stress_pa.begin(), b.stress_pa.end());
    row.insert(row.end(), b.displacement_m.begin(), b.displacement_m.end());
    sink_(tables_[&p - e_.probes.data()], row);
  }
}

}  // namespace grouser::dem::experiment
