#pragma once

#include "dem_offline/engine/gpu/list_body.h"

// Index bodies of the search for grains near bodies: counted tile by tile, then
// written in their order.

namespace grouser::dem::gpu {

GROUSER_HD bool Searched(const EnsembleView& v, const BodyRecord& b) {
  const WorldState& s = v.states[b.world];
  return (b.search || s.search) && !s.fault && !s.overflow;
}
GROUSER_HD bool MayTurn(const RigidBody& b) {
  return b.motion == BodyMotion::kFree || DotD(b.spin_rad_per_s, b.spin_rad_per_s) > 0;
}
/// Whether a grain comes near before the next search.
GROUSER_HD bool NearBody(const BodyRecord& b, bool turning, const Grain& g) {
  const BodyView& view = b.touch.body;
  float away;
  if (view.plane) {
    away = view.PlaneDistance(g);
  } else {
    const Vec3f p = view.ToBody(view.Relative(g));
    away = shape_body::Slacken(turning ? shape_body::Swept(b.shape, p)
                                       : shape_body::Still(b.shape, p));
  }
  return away - g.radius < static_cast<float>(b.track.margin_m) + b.touch.range;
}

/// Calls f(place) for the grains of a tile that are near, in order.
template <class F>
GROUSER_HD void ForNear(const EnsembleView& v, const BodyRecord& b, std::int64_t tile, F&& f) {
  const WorldView& w = v.worlds[b.world];
  const bool turning = MayTurn(b.body);
  for (std::int64_t place = tile * kTile; place < (tile + 1) * kTile && place < w.count; ++place) {
    if (NearBody(b, turning, v.grain[w.first + place])) f(static_cast<std::int32_t>(place));
  }
}

/// Index body: a tile of a body's world.
struct CountNear {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t t) const {
    const BodyRecord& b = v.bodies[v.body_of_tile[t]];
    if (!Searched(v, b)) return;
    std::int32_t n = 0;
    ForNear(v, b, t - b.first_tile, [&](std::int32_t) { ++n; });
    v.tile_near[t] = n;
  }
};

/// Index body: a body. Where the near grains of each tile begin.
struct ScanNear {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t number) const {
    BodyRecord& b = v.bodies[number];
    if (!Searched(v, b)) return;
    const WorldView& w = v.worlds[b.world];
    std::int32_t sum = 0;
    for (std::int64_t t = 0; t * kTile < w.count; ++t) {
      const std::int32_t n = v.tile_near[b.first_tile + t];
      v.tile_near[b.first_tile + t] = sum;
      sum += n;
    }
    b.count[1 - b.turn] = sum;
    if (sum > b.capacity) Raise(&v.states[b.world].overflow, kBodyFull);
  }
};

/// Index body: a tile of a body's world. Histories come along.
struct ListNear {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t t) const {
    const BodyRecord& b = v.bodies[v.body_of_tile[t]];
    if (!Searched(v, b)) return;
    const int from = b.turn, to = 1 - b.turn;
    std::int32_t k = v.tile_near[t];
    ForNear(v, b, t - b.first_tile, [&](std::int32_t place) {
      v.near_body[to][b.first_entry + k] = place;
      v.clear[b.first_entry + k] = 0.0f;
      const std::int32_t before = v.was ? v.was[v.worlds[b.world].first + place] : place;
      const std::int32_t was = Find(v.near_body[from] + b.first_entry, b.count[from], before);
      for (int s = 0; s < b.per_grain; ++s) {
        const std::int64_t new_slot = b.first_slot + k * b.per_grain + s;
        const std::int64_t old_slot = b.first_slot + was * b.per_grain + s;
        v.key[to][new_slot] = was >= 0 ? v.key[from][old_slot] : -1;
        for (int n = 0; n < v.words; ++n) {
          v.word[to][new_slot * v.words + n] =
              was >= 0 ? v.word[from][old_slot * v.words + n] : 0.0f;
        }
      }
      ++k;
    });
  }
  /// In a rising list; -1: not there.
  static GROUSER_HD std::int32_t Find(const std::int32_t* list, std::int32_t n, std::int32_t what) {
    std::int32_t low = 0;
    while (low < n) {
      const std::int32_t mid = (low + n) / 2;
      if (list[mid] == what) return mid;
      if (list[mid] < what) {
        low = mid + 1;
      } else {
        n = mid;
      }
    }
    return -1;
  }
};

/// Index body: a body; its list is new.
struct SettleBody {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t number) const {
    BodyRecord& b = v.bodies[number];
    if (!Searched(v, b)) return;
    b.turn = 1 - b.turn;
    b.track.moved_m = 0;
    b.track.turning = MayTurn(b.body);
    b.search = 0;
  }
};

}  // namespace grouser::dem::gpu
