#pragma once

#include "surrogate/models/bekker_lanes.h"

/// The load balance of BekkerModel and its answers, for packs of states. Two Newton
/// steps with few points land near it; a bracketed search on all outputs follows, which
/// mostly takes one step: the outputs go on along their slopes to where F_z is the load.
namespace grouser::surrogate::bekker {

inline constexpr int kMostSteps = 100;
inline constexpr double kExact = 1e-10;  // |ln(F_z/load)| that is none
// Error by Bend that is none: of three million random soils and states the worst balance
// is then 3e-10 of the load off.
inline constexpr double kClose = 2e-10;

/// The search in ln theta_f, on ln(F_z/load), which is nearly a straight line.
template <class V>
struct Search {
  V theta, low, high, f_low, f_high;  // bracket; 0: not yet known
};

/// What a step of the search finds.
template <class V>
struct Found {
  Mask<V> settled, overload;
  V value[kOutputs];  // in the canonical half-space
};

template <class V>
GROUSER_INLINE V LogRatio(V f_z, V load) {
  return Log(Max(f_z / load, Set<V>(1e-12)));
}

/// A slope that makes sense, else that of a uniform profile.
template <class V>
GROUSER_INLINE Mask<V> IsSound(V slope) {
  return (slope > 0.2) & (slope < 50);
}
template <class V>
GROUSER_INLINE V SoundSlope(const BekkerLaw<double>& a, V slope) {
  return Select(IsSound(slope), slope, Set<V>(2 * a.n + 1));
}

/// Starts a search from the law of a uniform profile, b k (z/S)^n sqrt(2 r z) times
/// kProfile, bettered by two Newton steps.
template <class V, class How>
GROUSER_INLINE Search<V> Begin(const BekkerLaw<double>& a, const Motion<V>& m, V load,
                               const BekkerRules& rules, How how) {
  constexpr double kProfile = 0.7;
  const V stiffness =
      Log(Set<V>(kProfile * a.width)) + 0.5 * Log(Set<V>(2 * a.radius)) + a.log_modulus;
  const V log_z = (Log(load) - stiffness - m.log_ease) * (1 / (a.n + 0.5));
  const V z = Exp(Min(Max(log_z, Set<V>(-200)), Set<V>(200)));
  Search<V> s{};
  s.theta = Min(Sqrt(2.0 * z * (1 / a.radius)), Set<V>(a.theta_max));
  for (const QuadratureRule& rule : rules.first) {
    const Dual<V, 1> f_z = VerticalForce(a, m, Dual<V, 1>{s.theta, {s.theta}}, rule, how);
    const V slope = SoundSlope<V>(a, f_z.d[0] / Max(f_z.v, Set<V>(1e-300)));
    const V step = -LogRatio(f_z.v, load) / slope;
    s.theta = s.theta * Exp(Min(Max(step, Set<V>(-10)), Set<V>(0.25)));
    s.theta = Min(s.theta, Set<V>(a.theta_max));
  }
  return s;
}

/// Error of GoOn after a step in ln theta_f, over the step's square and the outputs'
/// scales. A short shear displacement whose direction changes within the contact bends
/// them most. Measured: half of random soils and states below 0.2, 99 of 100 below 4;
/// twice what is returned, in which J is the largest change of j/K in ln theta_f, the worst.
template <class V>
GROUSER_INLINE V Bend(const Motion<V>& m, V theta) {
  return 10.0 +
         (2 * theta) * (Abs(m.spin - m.forward) + 0.5 * (m.forward * theta * theta) + m.lateral);
}

/// Outputs after a short step in ln theta_f to where F_z is the load, along which their
/// ratios to F_z go straight. at: with derivatives by ln theta_f.
template <class V>
GROUSER_INLINE void GoOn(const Forces<Dual<V, 1>>& at, V load, V step, Mask<V> goes, V* value) {
  const Dual<V, 1>& f_z = at.of[kFz];
  const V inverse = 1.0 / f_z.v;
  for (int o = 0; o < kSinkage; ++o) {
    const V ratio = at.of[o].v * inverse;
    const V slope = (at.of[o].d[0] - ratio * f_z.d[0]) * inverse;
    value[o] = Select(goes, o == kFz ? load : load * (ratio + slope * step), at.of[o].v);
  }
}

/// The search's step number `count` from 0.
template <class V, class How>
GROUSER_INLINE Found<V> Step(const BekkerLaw<double>& a, const Motion<V>& m, V load,
                             const QuadratureRule& rule, bool sideways, int count, How how,
                             Search<V>* s) {
  const auto at = AllForces(a, m, Dual<V, 1>{s->theta, {s->theta}}, rule, sideways, how);
  const Dual<V, 1>& f_z = at.of[kFz];
  const V f = LogRatio(f_z.v, load), most = Set<V>(a.theta_max);
  const V slope = f_z.d[0] / Max(f_z.v, Set<V>(1e-300)), newton = -f / slope;
  const Mask<V> below = f < 0, above = !below;
  s->low = Select(below, s->theta, s->low);
  s->f_low = Select(below, f, s->f_low);
  s->high = Select(above, s->theta, s->high);
  s->f_high = Select(above, f, s->f_high);
  const Mask<V> closed = (s->high > 0) & (s->low > 0) & (s->high - s->low <= 1e-15 * s->high);
  Found<V> found;
  found.overload = (s->low >= most) & (f < -kExact);
  const V after = s->theta * (1.0 + newton * (1.0 + 0.5 * newton));
  const Mask<V> goes = IsSound(slope) & (newton * newton * Bend(m, s->theta) <= kClose) &
                       (after <= most) & !found.overload;
  found.settled = goes | (Abs(f) <= kExact) | found.overload | closed;
  GoOn(at, load, newton, goes, found.value);

  // At most a factor 1.6 in sinkage a step upwards: the first crossing is the balance.
  // Where F_z hardly grows, longer and longer steps bracket it.
  const Mask<V> no_high = s->high <= 0, no_low = s->low <= 0, both = !(no_high | no_low);
  const double longer = count < 6 ? 1 : count < 60 ? static_cast<double>(1ll << (count - 5)) : 1e18;
  const V stride = Select(both, Set<V>(1), Set<V>(longer));
  const V step = Min(Max(-f * stride / SoundSlope<V>(a, slope), Set<V>(-10)), Set<V>(0.235));
  V next = s->theta * Exp(step);
  next = Select(no_high, Min(next, most), next);
  next = Select(no_low & (next >= s->high), 0.5 * s->high, next);
  const Mask<V> lost = both & ((next <= s->low) | (next >= s->high));
  if (count >= 8 || Any<V>(lost)) {
    // False position and bisection in turn: the bracket shrinks whatever F_z does.
    const V share = count % 2 == 0 ? s->f_low / (s->f_low - s->f_high) : Set<V>(0.5);
    const Mask<V> replace = count >= 8 ? both : lost;
    const V ratio = Select(both, s->high / s->low, Set<V>(1));
    next = Select(replace, s->low * Exp(share * Log(ratio)), next);
  }
  s->theta = Select(goes, after, Select(found.settled, s->theta, next));
  found.value[kSinkage] = Select(found.overload, Set<V>(kMostSinkage * a.radius),
                                 V((2 * a.radius) * SinCos(s->theta).half_sin2));
  return found;
}

/// What forces at theta, with derivatives in N directions and then with theta_f,
/// say of the balance: outputs at constant load, by the implicit function theorem
/// d theta_f/dx = -(dF_z/dx)/(dF_z/d theta_f).
template <class V, int N>
struct Equilibrium {
  Dual<V, N> of[kOutputs];
  V by_load[kOutputs];
  Dual<V, N> theta_f;
};
template <int N, class V>
GROUSER_INLINE Equilibrium<V, N> Close(const BekkerLaw<double>& a, const Forces<Dual<V, N + 1>>& f,
                                       V theta, Mask<V> overload, V load) {
  const Dual<V, N + 1>& f_z = f.of[kFz];
  // Rising where it crosses the load for the first time; the floor is for rounding.
  const V slope = Max(f_z.d[N], 1e-6 * Abs(f_z.v));
  const V per_newton = Select(overload, V{}, 1.0 / slope);  // d theta_f/d load
  const V rest = Min((load - f_z.v) * per_newton, a.theta_max - theta);
  Equilibrium<V, N> e;
  e.theta_f.v = theta + rest;
  for (int k = 0; k < N; ++k) e.theta_f.d[k] = -(per_newton * f_z.d[k]);
  for (int o = 0; o < kOutputs; ++o) {
    const Dual<V, N + 1>& at = f.of[o];
    e.of[o].v = at.v + at.d[N] * rest;
    for (int k = 0; k < N; ++k) {
      const V moved = at.d[k] + at.d[N] * e.theta_f.d[k];
      e.of[o].d[k] = o == kFz ? Select(overload, moved, V{}) : moved;
    }
    e.by_load[o] = at.d[N] * per_newton;
  }
  return e;
}

/// p, y, q of Canonical, with derivatives by v_x, v_y and r w in directions 0, 1, 2
/// where T has them; at rest those are 0.
template <class T>
struct Kinematics {
  T p, y, q;
  Base<T> sign_x, sign_y;      // mirrors of the values, 0 where symmetry makes them 0
  Base<T> mirror_x, mirror_y;  // the same for gradients: never 0
};
template <class T, class V>
GROUSER_INLINE Kinematics<T> Canonicalise(V v_x, V v_y, V rim) {
  const V largest = Max(Max(Abs(v_x), Abs(v_y)), Abs(rim)), one = Set<V>(1);
  const Mask<V> still = largest <= 0;
  const V scale = Select(still, one, largest), moves = Select(still, V{}, one / scale);
  const T x = Seed<T>(v_x / scale, 0, moves), y = Seed<T>(v_y / scale, 1, moves);
  const T u = Seed<T>(rim / scale, 2, moves);
  const T hub = Sqrt(T(x * x + y * y)), turning = Abs(u);
  const T faster = Select(Value(turning) > Value(hub), turning, hub);
  const T most = Select(still, Constant<T>(one), faster);
  const Mask<V> halted = (v_x <= 0) & (v_x >= 0);
  const Mask<V> backward = (v_x < 0) | (halted & (rim < 0));
  Kinematics<T> k;
  k.mirror_x = Select(backward, -one, one);
  k.mirror_y = Select(v_y < 0, -one, one);
  k.sign_x = Select(halted & (rim <= 0) & (rim >= 0), V{}, k.mirror_x);
  k.sign_y = Select((v_y <= 0) & (v_y >= 0), V{}, k.mirror_y);
  k.p = k.mirror_x * x / most;
  k.y = k.mirror_y * y / most;
  k.q = k.mirror_x * u / most;
  return k;
}

/// The states of a block that the lanes of a V hold: of `count` places from `place` on,
/// again the first one in lanes beyond.
template <class V>
struct Lanes {
  static constexpr int kMost = sizeof(V) / sizeof(double);
  int count, at[kMost];

  GROUSER_INLINE Lanes(const int* place, int some) : count(some) {
    for (int l = 0; l < kMost; ++l) at[l] = place[l < some ? l : 0];
  }
  GROUSER_INLINE V Of(const double* from) const {
    if constexpr (kMost == 1) {
      return from[at[0]];
    } else {
      V v{};
      for (int l = 0; l < kMost; ++l) v[l] = from[at[l]];
      return v;
    }
  }
  GROUSER_INLINE void Put(V v, double* to) const {
    double lane[kMost];
    Store(lane, v);
    for (int l = 0; l < count; ++l) to[at[l]] = lane[l];
  }
};

/// Step number `count` of some states of a block.
template <class V, class How>
GROUSER_INLINE void StepLanes(const BekkerLaw<double>& a, const BekkerRules& rules,
                              const Lanes<V>& lanes, int count, How how, StateBlock* b) {
  const V v_y = lanes.Of(b->v_y), load = lanes.Of(b->load), one = Set<V>(1);
  const Kinematics<V> k = Canonicalise<V>(lanes.Of(b->v_x), v_y, lanes.Of(b->rim_speed));
  const Motion<V> m = MakeMotion(a, k.p, k.y, k.q);
  Search<V> s;
  if (count == 0) {
    s = Begin(a, m, load, rules, how);
  } else {
    s = {lanes.Of(b->theta), lanes.Of(b->low), lanes.Of(b->high), lanes.Of(b->f_low),
         lanes.Of(b->f_high)};
  }
  const bool sideways = Any<V>((v_y < 0) | (v_y > 0));
  const Found<V> found = Step(a, m, load, rules.full, sideways, count, how, &s);
  lanes.Put(s.theta, b->theta);
  lanes.Put(s.low, b->low);
  lanes.Put(s.high, b->high);
  lanes.Put(s.f_low, b->f_low);
  lanes.Put(s.f_high, b->f_high);
  lanes.Put(Select(found.settled, one, V{}), b->settled);
  lanes.Put(Select(found.overload, one, V{}), b->overload);
  lanes.Put(Set<V>(count + 1), b->steps);
  const V sign[kOutputs] = {k.sign_x, k.sign_y, one, k.sign_x, k.sign_x * k.sign_y, one};
  for (int o = 0; o < kOutputs; ++o) lanes.Put(found.value[o] * sign[o] + 0.0, b->value[o]);
}

/// Gradients of some states of a block, where their searches ended.
template <class V, class How>
GROUSER_INLINE void SlopeLanes(const BekkerLaw<double>& a, const BekkerRules& rules,
                               const Lanes<V>& lanes, How how, StateBlock* b) {
  constexpr int kDirections = kInputs - 1;
  using T = Dual<V, kDirections + 1>;  // the last: theta_f
  const V theta = lanes.Of(b->theta), one = Set<V>(1);
  const Kinematics<T> k =
      Canonicalise<T>(lanes.Of(b->v_x), lanes.Of(b->v_y), lanes.Of(b->rim_speed));
  const auto forces = AllForces(a, MakeMotion(a, k.p, k.y, k.q), Seed<T>(theta, kDirections, one),
                                rules.full, true, how);
  const auto e =
      Close<kDirections>(a, forces, theta, Mask<V>(lanes.Of(b->overload) > 0), lanes.Of(b->load));
  const V sign[kOutputs] = {k.sign_x, k.sign_y, one, k.sign_x, k.sign_x * k.sign_y, one};
  const V turn[kOutputs] = {k.mirror_x, k.mirror_y, one, k.mirror_x, k.mirror_x * k.mirror_y, one};
  for (int o = 0; o < kOutputs; ++o) {
    for (int i = 0; i < kDirections; ++i) {
      lanes.Put(e.of[o].d[i] * turn[o] + 0.0, b->gradient[o][i]);
    }
    lanes.Put(e.by_load[o] * sign[o] + 0.0, b->gradient[o][kLoad]);
  }
}

/// do_pack or do_one for all states of a list: packs of states, but few ones by
/// themselves, by packs of points, which takes less.
template <class Pack, class DoPack, class DoOne>
GROUSER_INLINE void ForEachPack(const int* list, int count, const DoPack& do_pack,
                                const DoOne& do_one) {
  constexpr int kAlone = 3;
  int at = 0;
  for (; count - at > kAlone; at += Lanes<Pack>::kMost) {
    do_pack(
        Lanes<Pack>(list + at, count - at < Lanes<Pack>::kMost ? count - at : Lanes<Pack>::kMost));
  }
  for (; at < count; ++at) do_one(Lanes<double>(list + at, 1));
}

/// Solves the first `count` states of a block. States that need more steps than their
/// neighbours are packed anew for each.
template <class Pack>
GROUSER_INLINE void SolveStates(const BekkerLaw<double>& a, const BekkerRules& rules,
                                bool gradients, int count, StateBlock* b) {
  int all[kStateBlock], open[kStateBlock], left = count;
  for (int l = 0; l < count; ++l) all[l] = open[l] = l;
  for (int step = 0; left > 0 && step < kMostSteps; ++step) {
    ForEachPack<Pack>(
        open, left,
        [&](const Lanes<Pack>& lanes) { StepLanes(a, rules, lanes, step, StatesInLanes{}, b); },
        [&](const Lanes<double>& one) {
          StepLanes(a, rules, one, step, PointsInLanes<Pack>{}, b);
        });
    int still = 0;
    for (int l = 0; l < left; ++l) {
      if (b->settled[open[l]] == 0) open[still++] = open[l];
    }
    left = still;
  }
  if (!gradients) return;
  ForEachPack<Pack>(
      all, count,
      [&](const Lanes<Pack>& lanes) { SlopeLanes(a, rules, lanes, StatesInLanes{}, b); },
      [&](const Lanes<double>& one) { SlopeLanes(a, rules, one, PointsInLanes<Pack>{}, b); });
}

}  // namespace grouser::surrogate::bekker
