#pragma once

#include "dem_offline/engine/core/drift_body.h"
#include "dem_offline/engine/gpu/clump_step_body.h"
#include "dem_offline/engine/gpu/wheel_body.h"

// Index bodies of the step itself.

namespace grouser::dem::gpu {

struct Drift {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t i) const {
    const Member m = MemberAt(v, i);
    WorldState& s = v.states[m.world];
    if (m.place < 0 || s.halted || s.overflow || s.steps >= s.until) return;
    std::int32_t fault = 0;
    bool beyond = false;
    DriftOne(v.worlds[m.world].drift, m.place, &fault, &beyond);
    if (fault) Raise(&s.fault, fault);
    if (beyond) Raise(&s.stale, 1);
  }
};

/// Forces on one grain: of all its contacts, in their order. Both grains of a
/// contact evaluate it, from the lower place's side, and keep a history each,
/// which are equal.
template <class Laws>
struct Forces {
  using Law = typename Laws::Law;
  EnsembleView v;
  bool starting;
  GROUSER_HD void operator()(std::int64_t i) const {
    const Member m = MemberAt(v, i);
    const WorldState& s = v.states[m.world];
    if (m.place < 0 || (starting ? s.started != 0 || s.overflow : Waits(s))) return;
    const WorldView& w = v.worlds[m.world];
    const Law law = Laws::Of(v, m.world);
    const Grain own = v.grain[i];
    const std::int64_t slots = static_cast<std::int64_t>(v.inner_slots) * v.words;
    float* const history = v.history[s.turn];
    GrainLoad sum = {};
    ContactEnergy energy = {};
    for (int k = 0; k < v.inner_count[s.turn][i]; ++k) {
      const std::int32_t j = v.inner_partner[s.turn][EnsembleView::At(i, k, v.inner_slots)];
      const bool first = m.place < j;
      const Grain other = v.grain[w.first + j];
      const Grain &a = first ? own : other, &b = first ? other : own;
      const Separation apart =
          Separate<Law::kRange>(WrapDiff(a.x, b.x), WrapDiff(a.y, b.y), WrapDiff(a.z, b.z),
                                a.radius + b.radius, w.drift.quantum, w.range);
      float word[Law::kMostWords];
      bool alive = apart.touch;
      for (int n = 0; n < law.Words(); ++n) {
        word[n] = history[EnsembleView::At(i, k * v.words + n, slots)];
        alive = alive || word[n] != 0.0f;
      }
      if (!alive) continue;
      ContactEnergy one;
      const ContactLoads c =
          EvaluateContact(law, SideOf(a), SideOf(b), apart, w.range, w.drift.dt, word, &one);
      if (first) energy.Add(one);
      for (int n = 0; n < law.Words(); ++n) {
        history[EnsembleView::At(i, k * v.words + n, slots)] = word[n];
      }
      const float sign = first ? 1.0f : -1.0f;
      sum.Add(sign * c.force, first ? c.on_first : c.on_second);
      sum.deepest = Max(sum.deepest, c.deepest);
      sum.touching += c.touching;
    }
    v.load[i] = sum;
    if (w.energy) v.grain_energy[i] = energy;
  }
};

/// Index body: a tile; its grains, in their order.
struct SumTile {
  EnsembleView v;
  bool starting;
  GROUSER_HD void operator()(std::int64_t tile) const {
    const std::int32_t world = v.world_of_tile[tile];
    const WorldView& w = v.worlds[world];
    const WorldState& s = v.states[world];
    if (!w.energy || (starting ? s.started != 0 || s.overflow : Waits(s))) return;
    EnergySums sum;
    for (std::int64_t i = tile * kTile; i < (tile + 1) * kTile && i < w.first + w.count; ++i) {
      sum.Add(v.grain_energy[i]);
    }
    v.tile_energy[tile].AddStep(sum);
    if (starting) v.tile_energy[tile] = SumBody::Stored(sum);
  }
};

/// Velocities of time zero to half a step before.
struct SetBack {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t i) const {
    const Member m = MemberAt(v, i);
    if (m.place < 0 || v.states[m.world].started || (v.grain[i].kind & kHeld) != 0) return;
    const WorldView& w = v.worlds[m.world];
    StepBack(w.gravity, 0.5f * w.drift.dt, w.inertia_factor, w.drift.planar, v.load[i],
             &v.grain[i]);
  }
};
struct SetBodyBack {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t number) const {
    BodyRecord& b = v.bodies[number];
    if (!v.states[b.world].started) StepBodyBack(b.around, &b.body, &b.track);
  }
};

/// Index body: a world has begun.
struct Begun {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t w) const {
    if (!v.states[w].overflow) v.states[w].started = 1;
  }
};

/// Index body: a world has done a step.
struct Tick {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t w) const {
    WorldState& s = v.states[w];
    if (!BodiesWait(s)) ++s.steps;
    if (s.fault) s.halted = 1;
  }
};

template <class Launch>
void RenewLists(const Launch& launch, const EnsembleView& v) {
  launch(v.grains, BoundDisplacements{v, false});
  launch(v.cells, ClearCell{v});
  launch(v.grains, FillCell{v});
  launch(v.grains, FindOuter{v});
  launch(v.grains, BoundDisplacements{v, true});
  launch(v.grains, PruneInner{v});
  launch(v.body_tiles, CountNear{v});
  launch(v.body_count, ScanNear{v});
  launch(v.body_tiles, ListNear{v});
  launch(v.body_count, SettleBody{v});
  launch(v.world_count, Settle{v});
}

template <class Laws, class Launch>
void AllForces(const Launch& launch, const EnsembleView& v, bool starting) {
  launch(v.grains, Forces<Laws>{v, starting});
  launch(v.grains / kTile, SumTile{v, starting});
  for (int r = 0; r < v.rounds; ++r) {
    const std::int64_t first = v.round_entry[r];
    launch(v.round_entry[r + 1] - first, TouchEntry<Laws>{v, first, starting});
  }
  launch(v.runs, SumRun{v});
  launch(v.body_count, SumBody{v, starting});
  launch(v.clump_count, LoadClump{v, starting});
}

/// Lists of all worlds where they are stale; of those that have not started
/// also the forces at the present positions, and then velocities half a step
/// back.
template <class Laws, class Launch>
void Start(const Launch& launch, const EnsembleView& v) {
  launch(v.body_count, PoseBody{v, false});
  RenewLists(launch, v);
  AllForces<Laws>(launch, v, true);
  launch(v.grains, SetBack{v});
  launch(v.body_count, SetBodyBack{v});
  launch(v.clump_count, SetClumpBack{v});
  launch(v.world_count, Begun{v});
}

/// One step of every world: drift, lists where they are stale, forces.
template <class Laws, class Launch>
void Step(const Launch& launch, const EnsembleView& v) {
  if (v.wheels) launch(v.world_count, SteerWheel{v});
  launch(v.clump_count, DriftClump{v});
  launch(v.grains, Drift{v});
  launch(v.body_count, PoseBody{v, true});
  RenewLists(launch, v);
  AllForces<Laws>(launch, v, false);
  if (v.wheels) {
    launch(v.world_count, RecordStress{v});
    launch(v.world_count, WatchWheel{v});
  }
  launch(v.world_count, Tick{v});
}

/// Calls f(laws) for the laws of a compiled combination, or for any laws with -1.
template <class F, class... R>
void WithCombination(int combination, CombinationList<R...>, F&& f) {
  int k = 0;
  bool done = false;
  ((k++ == combination ? (f(CombinationOf<R>{}), done = true) : false), ...);
  if (!done) f(AnyOf{});
}

}  // namespace grouser::dem::gpu
