#pragma once

#include "dem_offline/engine/core/drift_body.h"
#include "dem_offline/engine/gpu/list_body.h"

// Index bodies of clumps.

namespace grouser::dem::gpu {

/// Members of a clump in the ensemble's arrays.
struct MembersOf {
  const EnsembleView& v;
  const ClumpRecord& c;
  GROUSER_HD std::int64_t At(int k) const {
    return v.worlds[c.world].first + v.member_place[c.first_member + k];
  }
};
struct LoadOfMember : MembersOf {
  GROUSER_HD const GrainLoad& operator()(int k) const { return v.load[At(k)]; }
};
struct GrainOfMember : MembersOf {
  GROUSER_HD Grain& operator()(int k) const { return v.grain[At(k)]; }
};

/// Index body: a clump and its members, one step on.
struct DriftClump {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t n) const {
    ClumpRecord& c = v.clumps[n];
    WorldState& s = v.states[c.world];
    if (s.halted || s.overflow || s.steps >= s.until) return;
    const ClumpSurroundings& around = v.clump_around[c.world];
    MoveClump(around, &c.entry);
    const GrainOfMember grains{{v, c}};
    if (!PlaceClump(around, v.members + c.first_shape, c.members, grains, c.entry)) {
      Raise(&s.fault, kInfiniteGrain);
    }
  }
};

/// Index body: a clump; what its members felt.
struct LoadClump {
  EnsembleView v;
  bool starting;
  GROUSER_HD void operator()(std::int64_t n) const {
    ClumpRecord& c = v.clumps[n];
    const WorldState& s = v.states[c.world];
    if (starting ? s.started != 0 || s.overflow : BodiesWait(s)) return;
    GatherClump(v.clump_around[c.world], v.members + c.first_shape, c.members, LoadOfMember{{v, c}},
                &c.entry);
  }
};

struct SetClumpBack {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t n) const {
    ClumpRecord& c = v.clumps[n];
    if (!v.states[c.world].started) StepClumpBack(v.clump_around[c.world], &c.entry);
  }
};

}  // namespace grouser::dem::gpu
