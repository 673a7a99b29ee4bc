// Kick and drift, compiled once per instruction set. A grain is two vectors,
// (v m | w kind) and (x y z r), and stays in them: turning tiles into lanes and
// back costs more than the arithmetic. Instantiates nothing from the standard
// library.
#include "dem_offline/engine/core/drift_body.h"

namespace grouser::dem::GROUSER_ISA_NS {
namespace {

typedef float F8 __attribute__((vector_size(32), aligned(16), may_alias));
typedef std::int32_t I8 __attribute__((vector_size(32), aligned(16), may_alias));
typedef float F4 __attribute__((vector_size(16), may_alias));
typedef std::int32_t I4 __attribute__((vector_size(16), may_alias));

template <class To, class From>
GROUSER_HD To As(const From* p) {
  return *reinterpret_cast<const To*>(p);
}
GROUSER_HD F4 Splat(float a) { return F4{a, a, a, a}; }
GROUSER_HD F8 Splat8(float a) { return F8{a, a, a, a, a, a, a, a}; }
GROUSER_HD F4 Third(F4 a) { return __builtin_shuffle(a, I4{3, 3, 3, 3}); }
/// x + y + z in all lanes; lane 3 of `a` is 0.
GROUSER_HD F4 Sum3(F4 a) {
  const F4 b = a + __builtin_shuffle(a, I4{1, 0, 3, 2});
  return b + __builtin_shuffle(b, I4{2, 3, 0, 1});
}

/// What was wrong with any grain: one bit mask a kind, all lanes alike.
struct Faults {
  I4 infinite = {}, fast = {}, deep = {}, beyond = {};
};
GROUSER_HD bool Any(I4 a) { return (a[0] | a[1] | a[2]) != 0; }

/// Index body: one grain.
GROUSER_HD void DriftGrain(const DriftView& v, std::int64_t i, F8 gravity_dt, F4 per_quantum,
                           F4 quantum, I8 may_turn, Faults& faults) {
  Grain& g = v.grains[i];
  const I8 held = (g.kind & kHeld) != 0 ? I8{} : may_turn;
  F8& motion = *reinterpret_cast<F8*>(&g.vx);
  F8& rests = *reinterpret_cast<F8*>(v.kinetics + i);
  const F8 load = As<F8>(v.loads + i);
  const F8 inverse = __builtin_shuffle(rests, I8{3, 3, 3, 3, 7, 7, 7, 7});
  F8 left;
  const F8 sum = Kick<F8>(motion, rests, load, inverse * Splat8(v.dt), gravity_dt, &left);
  const F8 fresh = held ? sum * Splat8(v.drag) : motion;
  rests = held ? left : rests;
  motion = fresh;
  // Drift.
  const I4 xyz = {-1, -1, -1, 0};
  const F4 velocity = (F4)((I4)As<F4>(&g.vx) & xyz), spin = (F4)((I4)As<F4>(&g.wx) & xyz);
  const F4 v2 = Sum3(velocity * velocity), w2 = Sum3(spin * spin);
  I4& place = *reinterpret_cast<I4*>(&g);
  const F4 radius = Third((F4)place);
  const I4 slow = v2 * Splat(v.dt * v.dt) <= Splat(0.0625f) * radius * radius;  // no tunnelling
  const I4 go = (g.kind & (kMember | kFrozen)) != 0 ? I4{} : slow & xyz;
  F4& rest = *reinterpret_cast<F4*>(&g.rest_x);
  const F4 way = velocity * per_quantum + rest;
  const I4 whole = __builtin_convertvector((F4)((I4)way & go), I4);
  rest = go ? way - __builtin_convertvector(whole, F4) : rest;
  place += whole;
  const I4 bound = As<I4>(v.bounds + i);
  const F4 moved = __builtin_convertvector((place - bound) & xyz, F4) * quantum;
  faults.infinite |= ~(v2 + w2 < Splat(1e30f));  // NaN included
  faults.fast |= ~slow;
  faults.deep |= Third(As<F4>(v.loads + i)) > Splat(0.9f) * radius;
  faults.beyond |= Sum3(moved * moved) > Third((F4)bound);
}

void DriftTiles(const DriftView& v, std::int64_t from, std::int64_t to, DriftFound* found) {
  const float* a = v.gravity_dt;
  const F8 gravity_dt = {a[0], a[1], a[2], 0, 0, 0, 0, 0};
  const F4 per_quantum = {v.per_quantum[0], v.per_quantum[1], v.per_quantum[2], 0};
  const F4 quantum = {v.quantum[0], v.quantum[1], v.quantum[2], 0};
  const I8 all = {-1, -1, -1, 0, -1, -1, -1, 0}, flat = {-1, 0, -1, 0, 0, -1, 0, 0};
  Faults faults;
  for (std::int64_t t = from; t < to; ++t) {
    if (v.idle && v.idle[t]) continue;
    for (std::int64_t i = t * kLanes; i < (t + 1) * kLanes; ++i) {
      DriftGrain(v, i, gravity_dt, per_quantum, quantum, v.planar ? flat : all, faults);
    }
  }
  found->finite &= !Any(faults.infinite);
  found->slow &= !Any(faults.fast);
  found->apart &= !Any(faults.deep);
  found->beyond |= Any(faults.beyond);
}

}  // namespace
}  // namespace grouser::dem::GROUSER_ISA_NS
