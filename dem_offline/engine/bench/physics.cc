#include <algorithm>
#include <cmath>

#include "dem_offline/engine/bench/bed.h"
#include "dem_offline/engine/contact/contact_body.h"

namespace grouser::dem::bench {

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
    const Separation apart =
        Separate<false>(WrapDiff(a.x, b.x), WrapDiff(a.y, b.y), WrapDiff(a.z, b.z),
                        a.radius + b.radius, q.data(), 0.0f);
    if (!apart.touch) return;
    const ContactGeometry g = GeometryOf<false>(SideOf(a), SideOf(b), apart, 0.0f);
    float copy[kMaxHistoryWords];
    std::copy(words, words + model.layout().words, copy);
    // A step of no length: springs as they are.
    const Vec3f f = EvaluateGeneric(model.layout(), params, g, copy, 0.0f).force;
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
