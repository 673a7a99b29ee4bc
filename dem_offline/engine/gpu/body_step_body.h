#pragma once

#include "dem_offline/engine/gpu/body_list_body.h"

// Index bodies of rigid bodies in a step: motion, contacts, sums.

namespace grouser::dem::gpu {

/// Index body: a body. Moves it (or not, before the first step) and sees how it
/// stands to the grains in this step.
struct PoseBody {
  EnsembleView v;
  bool move;
  GROUSER_HD void operator()(std::int64_t number) const {
    BodyRecord& b = v.bodies[number];
    WorldState& s = v.states[b.world];
    if (move && BodiesWait(s)) return;
    if (move && MoveBody(b.around, b.reach, &b.body, &b.track)) b.search = 1;
    const double up = b.body.position_m[2] - b.origin_m[2];
    if (!(up > -0.5 * b.frame.z_span_m && up < 0.5 * b.frame.z_span_m)) {
      Raise(&s.fault, kBodyAway);
      return;
    }
    TouchView& t = b.touch;
    t.body = BodyView(b.body, PlaneOf(b.shape.parts, b.shape.part_count), b.frame, b.origin_m);
    t.shape = b.shape;
    t.hub = ToFloat(b.body.velocity_m_per_s);
    t.spin = ToFloat(b.body.spin_rad_per_s);
    t.stride = static_cast<float>(TravelOf(b.body, b.reach, b.around.dt_s, !b.round));
    t.params = v.ParamsOf(b.world);
  }
};

/// The laws of a world: a compiled law combination, or any.
template <class R>
struct CombinationOf {
  using Law = OneCombination<R>;
  static GROUSER_HD Law Of(const EnsembleView& v, std::int32_t world) {
    return {R::From(v.ParamsOf(world)[0])};
  }
};
struct AnyOf {
  using Law = AnyLaws;
  static GROUSER_HD Law Of(const EnsembleView& v, std::int32_t world) {
    return {v.layout, v.ParamsOf(world), v.materials};
  }
};

struct PartsOf {
  GROUSER_HD int operator()(const ShapeView& shape, Vec3f p, float reach, SurfacePoint* out) const {
    return shape_body::Points(shape, p, reach, nullptr, 0, out);
  }
};

/// Index body: an entry of a round; one grain near one body.
template <class Laws>
struct TouchEntry {
  EnsembleView v;
  std::int64_t first;  ///< entry of the round
  bool starting;
  GROUSER_HD void operator()(std::int64_t n) const {
    const std::int64_t entry = first + n;
    const BodyRecord& b = v.bodies[v.body_of_run[entry / kRun]];
    const std::int64_t k = entry - b.first_entry;
    WorldState& s = v.states[b.world];
    if (k >= b.count[b.turn] || (starting ? s.started != 0 || s.overflow : BodiesWait(s))) return;
    const std::int64_t at = v.worlds[b.world].first + v.near_body[b.turn][entry];
    const std::int64_t slot = b.first_slot + k * b.per_grain;
    const typename Laws::Law law = Laws::Of(v, b.world);
    bool through = false;
    v.touches[entry] = TouchGrain(b.touch, v.grain[at], Evaluate{law}, PartsOf{},
                                  v.key[b.turn] + slot, v.word[b.turn] + slot * v.words,
                                  v.clear + entry, v.load + at, v.records + slot, &through);
    if (through) Raise(&s.fault, kThroughBody);
  }
  struct Evaluate {
    const typename Laws::Law& law;
    GROUSER_HD ContactResult operator()(const PairParams& p, const ContactGeometry& g, float* words,
                                        float dt) const {
      return law.With(p, g, words, dt);
    }
  };
};

/// Index body: a run of entries, in their order.
struct SumRun {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t run) const {
    const BodyRecord& b = v.bodies[v.body_of_run[run]];
    RunSum sum;
    for (std::int64_t entry = run * kRun; entry < (run + 1) * kRun; ++entry) {
      const std::int64_t k = entry - b.first_entry;
      if (k >= b.count[b.turn]) break;
      for (int s = 0; s < v.touches[entry]; ++s) {
        const TouchRecord& r = v.records[b.first_slot + k * b.per_grain + s];
        sum.energy.Add(r.energy);
        if (r.active) sum.wrench.Add(r.force, r.moment);
      }
    }
    v.run_sums[run] = sum;
  }
};

/// Index body: a body; its runs, in their order.
struct SumBody {
  EnsembleView v;
  bool starting;
  GROUSER_HD void operator()(std::int64_t number) const {
    BodyRecord& b = v.bodies[number];
    const WorldState& s = v.states[b.world];
    if (starting ? s.started != 0 : BodiesWait(s)) return;
    RunSum sum;
    const std::int64_t first = b.first_entry / kRun;
    for (std::int64_t r = 0; r * kRun < b.count[b.turn]; ++r) {
      sum.wrench.Add(v.run_sums[first + r].wrench);
      sum.energy.Add(v.run_sums[first + r].energy);
    }
    const Wrench before = b.track.wrench;
    b.track.wrench = sum.wrench;
    if (!starting) BookWork(b.body, b.around.dt_s, before, &b.track);
    if (!v.worlds[b.world].energy) return;
    b.energy.AddStep(sum.energy);
    if (starting) b.energy = Stored(sum.energy);
  }
  /// A start dissipates nothing.
  static GROUSER_HD EnergySums Stored(const EnergySums& e) {
    EnergySums out;
    out.stored = e.stored;
    return out;
  }
};

}  // namespace grouser::dem::gpu
