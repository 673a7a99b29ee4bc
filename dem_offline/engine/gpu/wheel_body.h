#pragma once

#include "dem_offline/engine/gpu/body_step_body.h"
#include "dem_offline/engine/rig/stress_bin.h"
#include "dem_offline/engine/rig/wheel_step.h"

// Index bodies of wheel tests: one wheel a world, steered and watched on the
// device. What a step calls for that only the host can do makes its world wait.

namespace grouser::dem::gpu {

inline constexpr int kWheelSamples = 128;  ///< room between two visits of the host

struct WheelRecord {
  WheelDrive drive;
  BedLimit limit;
  WheelState state;
  StressGrid grid;
  std::int32_t body;     ///< of the ensemble
  std::int32_t events;   ///< since the host's last visit
  std::int32_t samples;  ///< in `sample`, likewise
  std::int32_t stress_stride, stress_steps;
  bool recording;          ///< in this step
  std::int64_t first_bin;  ///< into EnsembleView::stress
  WheelSample sample[kWheelSamples];
};

/// Index body: a world, before its step.
struct SteerWheel {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t world) const {
    const WorldState& s = v.states[world];
    if (BodiesWait(s)) return;
    WheelRecord& r = v.wheels[world];
    BodyRecord& b = v.bodies[r.body];
    wheel_step::Before(r.drive, b.track.wrench, &r.state, &b.body);
    r.recording = r.state.stage == WheelStage::kDrive && s.steps % r.stress_stride == 0;
    if (r.recording) ++r.stress_steps;
  }
};

/// Index body: a world; stresses of this step, in the order of the entries.
struct RecordStress {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t world) const {
    const WorldState& s = v.states[world];
    const WheelRecord& r = v.wheels[world];
    if (BodiesWait(s) || !r.recording) return;
    const BodyRecord& b = v.bodies[r.body];
    double* const sums = v.stress + r.first_bin;
    for (std::int32_t k = 0; k < b.count[b.turn]; ++k) {
      for (int n = 0; n < v.touches[b.first_entry + k]; ++n) {
        const TouchRecord& t = v.records[b.first_slot + k * b.per_grain + n];
        if (!t.active || !t.rim) continue;
        AddTo(sums, StressOf(r.grid, t.point, t.force));
      }
    }
  }
};

/// Index body: a world, after its step.
struct WatchWheel {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t world) const {
    WorldState& s = v.states[world];
    if (BodiesWait(s) || s.fault) return;
    WheelRecord& r = v.wheels[world];
    const BodyRecord& b = v.bodies[r.body];
    const std::int32_t events =
        wheel_step::After(r.drive, r.limit, b.body, b.track.wrench, &r.state);
    if (events & kSampled) r.sample[r.samples++] = r.state.sample;
    r.events |= events & ~kSampled;
    if (r.events == 0 && r.samples < kWheelSamples) return;
    s.called = 1;
    s.until = s.steps + 1;
  }
};

}  // namespace grouser::dem::gpu
