#pragma once

#include "dem_offline/engine/core/drift_kernel.h"
#include "dem_offline/engine/core/frame.h"

// Kick and drift of one grain in plain floats, for back ends whose lanes are
// threads; and the arithmetic that the vectors of drift_kernel.inl share with
// it. Same order of operations, same bits.

namespace grouser::dem {

/// motion + (load/mass dt + gravity dt + rest), and in *left what rounding took
/// from it (Knuth's two-sum). F: a float, or a vector of them.
template <class F>
GROUSER_HD F Kick(F motion, F rest, F load, F dt_over_mass, F gravity_dt, F* left) {
  const F y = load * dt_over_mass + gravity_dt + rest;
  const F sum = motion + y, back = sum - motion;
  *left = (motion - (sum - back)) + (y - back);
  return sum;
}

/// One axis: whole quanta of the way gone, the rest for the next step.
GROUSER_HD std::int32_t WholeQuanta(float velocity, float per_quantum, float* rest) {
  const float way = velocity * per_quantum + *rest;
  const auto whole = static_cast<std::int32_t>(way);
  *rest = way - static_cast<float>(whole);
  return whole;
}

GROUSER_HD float KickAxis(const DriftView& v, float motion, float load, float inverse,
                          float gravity_dt, float* rest) {
  float left;
  const float sum = Kick(motion, *rest, load, inverse * v.dt, gravity_dt, &left);
  *rest = left;
  return sum * v.drag;
}

/// Index body: one grain. Faults are ORed into *fault; beyond: past its displacement bound.
enum DriftFault : std::int32_t { kInfiniteGrain = 1, kFastGrain = 2, kDeepGrain = 4 };
GROUSER_HD void DriftOne(const DriftView& v, std::int64_t i, std::int32_t* fault, bool* beyond) {
  Grain g = v.grains[i];
  const GrainLoad load = v.loads[i];
  if ((g.kind & kHeld) == 0) {
    Kinetics k = v.kinetics[i];
    const float* a = v.gravity_dt;
    g.vx = KickAxis(v, g.vx, load.fx, k.inverse_mass, a[0], &k.vx);
    if (!v.planar) g.vy = KickAxis(v, g.vy, load.fy, k.inverse_mass, a[1], &k.vy);
    g.vz = KickAxis(v, g.vz, load.fz, k.inverse_mass, a[2], &k.vz);
    if (!v.planar) g.wx = KickAxis(v, g.wx, load.tx, k.inverse_inertia, 0.0f, &k.wx);
    g.wy = KickAxis(v, g.wy, load.ty, k.inverse_inertia, 0.0f, &k.wy);
    if (!v.planar) g.wz = KickAxis(v, g.wz, load.tz, k.inverse_inertia, 0.0f, &k.wz);
    v.kinetics[i] = k;
  }
  const float v2 = (g.vx * g.vx + g.vy * g.vy) + g.vz * g.vz;
  const float w2 = (g.wx * g.wx + g.wy * g.wy) + g.wz * g.wz;
  const bool slow = v2 * (v.dt * v.dt) <= 0.0625f * g.radius * g.radius;  // no tunnelling
  if (slow && (g.kind & (kMember | kFrozen)) == 0) {
    g.x = WrapDiff(g.x, -WholeQuanta(g.vx, v.per_quantum[0], &g.rest_x));
    g.y = WrapDiff(g.y, -WholeQuanta(g.vy, v.per_quantum[1], &g.rest_y));
    g.z = WrapDiff(g.z, -WholeQuanta(g.vz, v.per_quantum[2], &g.rest_z));
  }
  const DisplacementBound bound = v.bounds[i];
  const float mx = static_cast<float>(WrapDiff(g.x, bound.x)) * v.quantum[0];
  const float my = static_cast<float>(WrapDiff(g.y, bound.y)) * v.quantum[1];
  const float mz = static_cast<float>(WrapDiff(g.z, bound.z)) * v.quantum[2];
  if (!(v2 + w2 < 1e30f)) *fault |= kInfiniteGrain;  // NaN included
  if (!slow) *fault |= kFastGrain;
  if (load.deepest > 0.9f * g.radius) *fault |= kDeepGrain;
  *beyond = (mx * mx + my * my) + mz * mz > bound.length2;
  v.grains[i] = g;
}

/// A grain's velocities from time zero to half a step before.
GROUSER_HD void StepBack(const float* gravity, float half, float inertia_factor, bool planar,
                         const GrainLoad& f, Grain* g) {
  const float inertia = inertia_factor * g->mass * g->radius * g->radius;
  g->vx -= half * (f.fx / g->mass + gravity[0]);
  g->vy -= half * (f.fy / g->mass + gravity[1]);
  g->vz -= half * (f.fz / g->mass + gravity[2]);
  g->wx -= half * f.tx / inertia;
  g->wy -= half * f.ty / inertia;
  g->wz -= half * f.tz / inertia;
  if (planar) g->vy = g->wx = g->wz = 0.0f;
}

}  // namespace grouser::dem
