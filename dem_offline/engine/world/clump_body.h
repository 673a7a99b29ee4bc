#pragma once

#include <cstdint>

#include "dem_offline/engine/bodies/clump.h"
#include "dem_offline/engine/core/frame.h"
#include "dem_offline/engine/core/grain.h"
#include "dem_offline/engine/core/rotation.h"

// How rigid clumps move: index bodies that all back ends share.

namespace grouser::dem {

struct ClumpEntry {
  ClumpState state;  ///< position relative to the world's origin
  Vec3d angular_momentum = {0, 0, 0};
  Vec3d force = {0, 0, 0}, moment = {0, 0, 0};
  double mass_kg = 0;
  Vec3d inertia = {0, 0, 0};
  std::int32_t first_id = 0;  ///< members follow one another
};

/// What a clump needs to know of its world.
struct ClumpSurroundings {
  Vec3d gravity_m_per_s2;
  double dt_s, drag;
  bool planar;
  Frame frame;
};

/// Sums the loads of the members; load_of(k): of member k.
template <class LoadOf>
GROUSER_HD void GatherClump(const ClumpSurroundings& around, const ClumpTemplate::Member* members,
                            int count, const LoadOf& load_of, ClumpEntry* e) {
  const Mat3d turn = MatrixOf(e->state.orientation);
  e->force = Scale(e->mass_kg, around.gravity_m_per_s2);
  e->moment = {0, 0, 0};
  for (int k = 0; k < count; ++k) {
    const GrainLoad& f = load_of(k);
    const Vec3d force = {f.fx, f.fy, f.fz};
    e->force = Add(e->force, force);
    e->moment = Add(e->moment, Add({f.tx, f.ty, f.tz}, CrossD(turn * members[k].offset_m, force)));
  }
}

/// Puts the members where the clump is; grain_of(k): member k. False where one
/// has left the frame.
template <class GrainOf>
GROUSER_HD bool PlaceClump(const ClumpSurroundings& around, const ClumpTemplate::Member* members,
                           int count, const GrainOf& grain_of, const ClumpEntry& e) {
  const Vec3d& spin = e.state.spin_rad_per_s;
  const Mat3d turn = MatrixOf(e.state.orientation);
  const Frame& frame = around.frame;
  for (int k = 0; k < count; ++k) {
    Grain& g = grain_of(k);
    const Vec3d off = turn * members[k].offset_m;
    const Vec3d at = Add(e.state.position_m, off);
    const Vec3d v = Add(e.state.velocity_m_per_s, CrossD(spin, off));
    const double level = at[0] + at[1];
    const bool inside = at[2] > -0.5 * frame.z_span_m && at[2] < 0.5 * frame.z_span_m;
    if (!inside || !(level - level == 0)) return false;  // infinite or no number
    g.x = WrapFix(at[0], frame.length_m);
    g.y = WrapFix(at[1], frame.width_m);
    g.z = SpanFix(at[2], frame.z_span_m);
    g.SetMotion(ToFloat(v), ToFloat(spin));
  }
  return true;
}

/// One step under the force and moment of the last.
GROUSER_HD void MoveClump(const ClumpSurroundings& around, ClumpEntry* e) {
  const double dt = around.dt_s;
  ClumpState& s = e->state;
  s.velocity_m_per_s =
      Scale(around.drag, Add(s.velocity_m_per_s, Scale(dt / e->mass_kg, e->force)));
  e->angular_momentum = Scale(around.drag, Add(e->angular_momentum, Scale(dt, e->moment)));
  if (around.planar) {
    s.velocity_m_per_s[1] = 0;
    e->angular_momentum[0] = e->angular_momentum[2] = 0;
  }
  s.position_m = Add(s.position_m, Scale(dt, s.velocity_m_per_s));
  s.orientation = TurnFreely(s.orientation, e->angular_momentum, e->inertia, dt, &s.spin_rad_per_s);
}

/// Velocities of time zero to the half step before.
GROUSER_HD void StepClumpBack(const ClumpSurroundings& around, ClumpEntry* e) {
  const double half = 0.5 * around.dt_s;
  e->state.velocity_m_per_s = Sub(e->state.velocity_m_per_s, Scale(half / e->mass_kg, e->force));
  e->angular_momentum = Sub(e->angular_momentum, Scale(half, e->moment));
}

}  // namespace grouser::dem
