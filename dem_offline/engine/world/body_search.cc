// Bodies of a World: which grains are near them.
#include <algorithm>
#include <utility>

#include "dem_offline/engine/world/touch_view.h"

namespace grouser::dem {
namespace {

int SlotsPerGrain(const Shape& s) {
  if (s.mesh) return kMostSurfacePoints;
  int parts = static_cast<int>(s.parts.size());
  for (const auto& ring : s.rings) parts += 2 - ring.count;  // two of a ring at most
  return std::clamp(parts, 1, kMostSurfacePoints);
}

}  // namespace

void BodyPass::Find(SimulationState& w, BodyEntry& b) {
  const BodyView view = BodyViewOf(w.config, b.body);
  BodySlots old = std::move(b.slots);
  BodySlots& now = b.slots;
  now = BodySlots{};
  now.per_grain = SlotsPerGrain(b.body.shape);
  const int words = w.list.words();
  b.moved_m = 0;
  const Vec3d& spin = b.body.spin_rad_per_s;
  b.turning = b.body.motion == BodyMotion::kFree || DotD(spin, spin) > 0;
  const auto distance = b.turning ? SweptDistance : StillDistance;
  const float margin = static_cast<float>(b.margin_m) + w.range;
  std::size_t before = 0;
  for (std::int64_t i = 0; i < w.count; ++i) {
    const Grain& g = w.grains[i];
    const float gap = (view.plane ? view.PlaneDistance(g)
                                  : distance(b.body.shape, view.ToBody(view.Relative(g)))) -
                      g.radius;
    if (!(gap < margin)) continue;
    const auto id = static_cast<std::int32_t>(i);
    now.near.push_back(id);
    while (before < old.near.size() && old.near[before] < id) ++before;
    if (before < old.near.size() && old.near[before] == id && old.per_grain == now.per_grain) {
      const auto k = static_cast<std::ptrdiff_t>(before) * old.per_grain;
      now.key.insert(now.key.end(), old.key.begin() + k, old.key.begin() + k + old.per_grain);
      now.words.insert(now.words.end(), old.words.begin() + k * words,
                       old.words.begin() + (k + old.per_grain) * words);
    } else {
      now.key.insert(now.key.end(), now.per_grain, -1);
      now.words.insert(now.words.end(), static_cast<std::size_t>(now.per_grain) * words, 0.0f);
    }
  }
  now.clear.assign(now.near.size(), 0.0f);
}

void BodyPass::FindAll(SimulationState& w) {
  for (BodyEntry& b : w.bodies) Find(w, b);
}

void BodyPass::Renumber(SimulationState& w, const std::vector<std::int32_t>& place_of) {
  const int words = w.list.words();
  for (BodyEntry& b : w.bodies) {
    const BodySlots old = b.slots;
    BodySlots& now = b.slots;
    std::vector<std::pair<std::int32_t, std::size_t>> order;
    for (std::size_t k = 0; k < old.near.size(); ++k) {
      const std::int32_t place = place_of[old.near[k]];
      if (place >= 0) order.push_back({place, k});
    }
    std::sort(order.begin(), order.end());
    now.near.clear();
    now.key.clear();
    now.words.clear();
    for (const auto& [place, k] : order) {
      now.near.push_back(place);
      const auto key = old.key.begin() + static_cast<std::ptrdiff_t>(k) * old.per_grain;
      now.key.insert(now.key.end(), key, key + old.per_grain);
      const auto word = old.words.begin() + static_cast<std::ptrdiff_t>(k) * old.per_grain * words;
      now.words.insert(now.words.end(), word, word + old.per_grain * words);
    }
    now.clear.assign(now.near.size(), 0.0f);
  }
}

}  // namespace grouser::dem
