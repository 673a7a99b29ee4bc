#pragma once

#include "surrogate/models/bekker_lanes.h"

/// The load balance of BekkerModel and its answers, for a double or a pack of
/// states. Two Newton steps with few points land near it; a bracketed search on all
/// outputs follows, and the line through its last two points ends at the load.
namespace grouser::surrogate::bekker {

inline constexpr int kMostSteps = 100;
inline constexpr double kExact = 1e-10;  // |ln(F_z/load)| that is none

/// The search in ln theta_f, on ln(F_z/load), which is nearly a straight line.
template <class V>
struct Search {
  V theta, low, high, f_low, f_high;    // bracket; 0: not yet known
  V slope, last_u, last_f;              // of ln(F_z/load), and where it was before
  Mask<V> settled, overload, straight;  // straight: the line ends it
  V steps;
  Forces<V> here, before;  // at theta, and at the step before
};

template <class V>
GROUSER_INLINE V LogRatio(V f_z, V load) {
  return Log(Max(f_z / load, Set<V>(1e-12)));
}

/// A slope that makes sense, else that of a uniform profile.
template <class V>
GROUSER_INLINE V SoundSlope(const BekkerLaw<double>& a, V slope) {
  return Select((slope > 0.2) & (slope < 50), slope, Set<V>(2 * a.n + 1));
}

/// Starts a search from the law of a uniform profile, b k (z/S)^n sqrt(2 r z) times
/// kProfile, bettered by two Newton steps.
template <class V>
GROUSER_INLINE Search<V> Begin(const BekkerLaw<double>& a, const Motion<V>& m, V load,
                               const BekkerRules& rules) {
  constexpr double kProfile = 0.7;
  const V stiffness =
      Log(Set<V>(kProfile * a.width)) + 0.5 * Log(Set<V>(2 * a.radius)) + a.log_modulus;
  const V log_z = (Log(load) - stiffness - m.log_ease) * (1 / (a.n + 0.5));
  const V z = Exp(Min(Max(log_z, Set<V>(-200)), Set<V>(200)));
  Search<V> s{};
  s.theta = Min(Sqrt(2.0 * z * (1 / a.radius)), Set<V>(a.theta_max));
  for (const QuadratureRule& rule : rules.first) {
    const Dual<V, 1> f_z = VerticalForce(a, m, Dual<V, 1>{s.theta, {Set<V>(1)}}, rule);
    s.slope = SoundSlope<V>(a, f_z.d[0] * s.theta / Max(f_z.v, Set<V>(1e-300)));
    const V step = -LogRatio(f_z.v, load) / s.slope;
    s.theta = s.theta * Exp(Min(Max(step, Set<V>(-10)), Set<V>(0.25)));
    s.theta = Min(s.theta, Set<V>(a.theta_max));
  }
  return s;
}

/// One step of the lanes that are not settled.
template <class V>
GROUSER_INLINE void Step(const BekkerLaw<double>& a, const Motion<V>& m, V load,
                         const QuadratureRule& rule, bool sideways, int count, Search<V>* s) {
  const Forces<V> at = AllForces(a, m, s->theta, rule, sideways);
  const V f = LogRatio(at.of[kFz], load), u = Log(s->theta), most = Set<V>(a.theta_max);
  const Mask<V> open = !s->settled, below = f < 0, above = !below;
  for (int o = 0; o < kOutputs; ++o) {
    s->before.of[o] = Select(open, s->here.of[o], s->before.of[o]);
    s->here.of[o] = Select(open, at.of[o], s->here.of[o]);
  }
  s->low = Select(open & below, s->theta, s->low);
  s->f_low = Select(open & below, f, s->f_low);
  s->high = Select(open & above, s->theta, s->high);
  s->f_high = Select(open & above, f, s->f_high);
  s->steps = Select(open, s->steps + 1.0, s->steps);
  // Between the last two points all is straight to second order, unless the shear
  // turned round between them: then the slope is another than the one they came by.
  const V way = u - s->last_u, last = count > 0 ? s->last_f : Set<V>(1e300);
  const V secant = (f - s->last_f) / Select((way < 0) | (way > 0), way, Set<V>(1));
  const Mask<V> straight = open & (s->theta < most) & (Abs(last) < 1e-3) &
                           (Abs(f) < 0.1 * Abs(last)) & (Abs(f) * Abs(last) < 0.1 * kExact) &
                           (Abs(secant - s->slope) < 0.1 * s->slope);
  const Mask<V> over = open & (s->low >= most) & (f < -kExact);
  const Mask<V> closed = (s->high > 0) & (s->low > 0) & (s->high - s->low <= 1e-15 * s->high);
  const Mask<V> stays = open & ((Abs(f) <= kExact) | over | closed | straight);
  s->overload = s->overload | over;
  s->straight = s->straight | straight;
  if (count > 0) s->slope = Select(secant > 0.2, Min(secant, Set<V>(50)), s->slope);
  s->last_u = u;
  s->last_f = f;

  // At most a factor 1.6 in sinkage a step upwards: the first crossing is the balance.
  // Where F_z hardly grows, longer and longer steps bracket it.
  const Mask<V> no_high = s->high <= 0, no_low = s->low <= 0, both = !(no_high | no_low);
  const double longer = count < 6 ? 1 : count < 60 ? static_cast<double>(1ll << (count - 5)) : 1e18;
  const V stride = Select(both, Set<V>(1), Set<V>(longer));
  const V step = Min(Max(-f * stride / s->slope, Set<V>(-10)), Set<V>(0.235));
  V next = s->theta * Exp(step);
  next = Select(no_high, Min(next, most), next);
  next = Select(no_low & (next >= s->high), 0.5 * s->high, next);
  const Mask<V> lost = both & ((next <= s->low) | (next >= s->high));
  if (count >= 8 || Any<V>(open & lost)) {
    // False position and bisection in turn: the bracket shrinks whatever F_z does.
    const V share = count % 2 == 0 ? s->f_low / (s->f_low - s->f_high) : Set<V>(0.5);
    const Mask<V> replace = count >= 8 ? both : lost;
    const V ratio = Select(both, s->high / s->low, Set<V>(1));
    next = Select(replace, s->low * Exp(share * Log(ratio)), next);
  }
  s->theta = Select(open & !stays, next, s->theta);
  s->settled = s->settled | stays;
}

template <class V>
GROUSER_INLINE Search<V> Balance(const BekkerLaw<double>& a, const Motion<V>& m, V load,
                                 const BekkerRules& rules, bool sideways) {
  Search<V> s = Begin(a, m, load, rules);
  for (int count = 0; count < kMostSteps && Any<V>(!s.settled); ++count) {
    Step(a, m, load, rules.full, sideways, count, &s);
  }
  return s;
}

/// Output o where the search ends.
template <class V>
GROUSER_INLINE V Ended(const BekkerLaw<double>& a, const Search<V>& s, int o, V load) {
  const V here = s.here.of[kFz], way = here - s.before.of[kFz];
  const V share = Select(s.straight, (load - here) / Select(s.straight, way, Set<V>(1)), V{});
  const V value = s.here.of[o] + (s.here.of[o] - s.before.of[o]) * share;
  return o == kSinkage ? Select(s.overload, Set<V>(kMostSinkage * a.radius), value) : value;
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
                                       const Search<V>& s, V load) {
  const Dual<V, N + 1>& f_z = f.of[kFz];
  // Rising where it crosses the load for the first time; the floor is for rounding.
  const V slope = Max(f_z.d[N], 1e-6 * Abs(f_z.v));
  const V per_newton = Select(s.overload, V{}, 1.0 / slope);  // d theta_f/d load
  const V rest = Min((load - f_z.v) * per_newton, a.theta_max - s.theta);
  Equilibrium<V, N> e;
  e.theta_f.v = s.theta + rest;
  for (int k = 0; k < N; ++k) e.theta_f.d[k] = -(per_newton * f_z.d[k]);
  for (int o = 0; o < kOutputs; ++o) {
    const Dual<V, N + 1>& at = f.of[o];
    e.of[o].v = at.v + at.d[N] * rest;
    for (int k = 0; k < N; ++k) {
      const V moved = at.d[k] + at.d[N] * e.theta_f.d[k];
      e.of[o].d[k] = o == kFz ? Select(s.overload, moved, V{}) : moved;
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

/// Solves the lanes of a block from `at`, as many as V has.
template <class V, bool kGradients>
GROUSER_INLINE void SolveLanes(const BekkerLaw<double>& a, const BekkerRules& rules,
                               StateBlock* block, int at) {
  const V load = Load<V>(&block->load[at]), v_x = Load<V>(&block->v_x[at]);
  const V v_y = Load<V>(&block->v_y[at]), rim = Load<V>(&block->rim_speed[at]);
  const Kinematics<V> k = Canonicalise<V>(v_x, v_y, rim);
  const bool sideways = Any<V>((v_y < 0) | (v_y > 0));
  const Search<V> s = Balance(a, MakeMotion(a, k.p, k.y, k.q), load, rules, sideways);
  const V one = Set<V>(1);
  const V sign[kOutputs] = {k.sign_x, k.sign_y, one, k.sign_x, k.sign_x * k.sign_y, one};
  for (int o = 0; o < kOutputs; ++o) {
    Store(&block->value[o][at], Ended(a, s, o, load) * sign[o] + 0.0);
  }
  Store(&block->overload[at], Select(s.overload, one, V{}));
  Store(&block->steps[at], s.steps);
  if constexpr (kGradients) {
    constexpr int kDirections = kInputs - 1;
    using T = Dual<V, kDirections + 1>;  // the last: theta_f
    const Kinematics<T> moved = Canonicalise<T>(v_x, v_y, rim);
    const auto forces = AllForces(a, MakeMotion(a, moved.p, moved.y, moved.q),
                                  Seed<T>(s.theta, kDirections, one), rules.full, true);
    const auto e = Close<kDirections>(a, forces, s, load);
    const V turn[kOutputs] = {k.mirror_x, k.mirror_y, one, k.mirror_x, k.mirror_x * k.mirror_y,
                              one};
    for (int o = 0; o < kOutputs; ++o) {
      for (int i = 0; i < kDirections; ++i) {
        Store(&block->gradient[o][i][at], e.of[o].d[i] * turn[o] + 0.0);
      }
      Store(&block->gradient[o][kLoad][at], e.by_load[o] * sign[o] + 0.0);
    }
  }
}

}  // namespace grouser::surrogate::bekker
