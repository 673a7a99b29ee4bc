#include "dem_offline/engine/bench/physics.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dem_offline/engine/laws/generic.h"

namespace grouser::dem::bench {
namespace {

/// Contact of grain a with grain b as `a` sees it; overlap <= 0: none.
ContactGeometry Geometry(const Grain& a, const Grain& b, const std::array<float, 3>& q) {
  const auto diff = [](std::int32_t i, std::int32_t j) {  // of a period: the nearest image
    return static_cast<float>(
        static_cast<std::int32_t>(static_cast<std::uint32_t>(i) - static_cast<std::uint32_t>(j)));
  };
  ContactGeometry g = {};
  const Vec3f d = {diff(a.x, b.x) * q[0], diff(a.y, b.y) * q[1], diff(a.z, b.z) * q[2]};
  const float distance = std::sqrt(Dot(d, d));
  g.overlap = a.radius + b.radius - distance;
  if (!(g.overlap > 0)) return g;
  g.n = (1 / distance) * d;
  g.r_own = a.radius;
  g.r_other = b.radius;
  g.r_eff = a.radius * b.radius / (a.radius + b.radius);
  g.m_own = a.mass;
  g.m_eff = a.mass * b.mass / (a.mass + b.mass);
  const float ia = 1.4f * a.mass * a.radius * a.radius, ib = 1.4f * b.mass * b.radius * b.radius;
  g.roll_inertia = ia * ib / (ia + ib);
  const Vec3f wa = {a.wx, a.wy, a.wz}, wb = {b.wx, b.wy, b.wz};
  const Vec3f v = {a.vx - b.vx, a.vy - b.vy, a.vz - b.vz};
  const float bite = 0.5f * g.overlap;
  g.v_rel = v - Cross((a.radius - bite) * wa + (b.radius - bite) * wb, g.n);
  g.w_rel = wa - wb;
  g.w_own = wa;
  return g;
}

}  // namespace

double StressVolume(const Bed& bed) { return bed.length_m * bed.width_m * bed.height_m; }

Physics Measure(const World& world, double volume_m3) {
  const auto q = world.config().frame.Quantum();
  const ContactModel& model = world.config().contacts;
  const PairParams params = model.Table().front();
  const auto& grains = world.grains();
  Physics out;
  double overlap = 0, zz = 0, xz = 0;
  world.list().ForEachHistory([&](std::int32_t i, std::int32_t j, const float* words) {
    const Grain &a = grains[i], &b = grains[j];
    if ((a.kind & kGlued) && (b.kind & kGlued)) return;
    const ContactGeometry g = Geometry(a, b, q);
    if (!(g.overlap > 0)) return;
    float copy[kMaxHistoryWords];
    std::copy(words, words + model.layout().words, copy);
    // A step of no length: springs as they are.
    const Vec3f f = EvaluateGeneric(model.laws(), model.layout(), params, g, copy, 0.0f).force;
    const double distance = a.radius + b.radius - g.overlap;
    zz += f.z * distance * g.n.z;
    xz += f.x * distance * g.n.z;
    overlap += g.overlap / std::min(a.radius, b.radius);
    ++out.contacts;
  });
  const auto free = std::count_if(grains.begin(), grains.end(),
                                  [](const Grain& g) { return g.id >= 0 && !(g.kind & kGlued); });
  out.mean_overlap_over_radius =
      overlap / static_cast<double>(std::max<std::int64_t>(1, out.contacts));
  out.coordination = 2.0 * static_cast<double>(out.contacts) /
                     static_cast<double>(std::max<std::int64_t>(1, free));
  out.stress_zz_pa = zz / volume_m3;
  out.stress_xz_pa = xz / volume_m3;
  return out;
}

}  // namespace grouser::dem::bench
