#pragma once

#include "surrogate/models/bekker_lanes.h"

/// The load balance of BekkerModel and its answers, for a double or a pack of
/// states. Two Newton steps with few points land near it; a bracketed search ends
/// within 1e-4 of the load, one more Newton step and a linear correction of every
/// output leave less than 1e-10 of it.
namespace grouser::surrogate::bekker {

inline constexpr int kMostSteps = 100;
inline constexpr double kNear = 1e-4;    // |ln(F_z/load)| from where Newton is exact enough
inline constexpr double kExact = 1e-10;  // the same where the slope is not to be trusted

/// The search in ln theta_f, on ln(F_z/load), which is nearly a straight line.
template <class V>
struct Search {
  V theta, low, high, f_low, f_high;  // bracket; 0: not yet known
  Mask<V> settled, overload;
  V steps;
};

template <class V>
GROUSER_INLINE V LogRatio(V f_z, V load) {
  return Log(Max(f_z / load, Set<V>(1e-12)));
}

/// d ln F_z/d ln theta_f, and whether it makes sense; else that of a uniform profile.
template <class V>
struct LogSlope {
  V slope;
  Mask<V> sound;
};
template <class V>
GROUSER_INLINE LogSlope<V> SlopeOf(const BekkerLaw<double>& a, const Dual<V, 1>& f_z, V theta) {
  const V slope = f_z.d[0] * theta / Max(f_z.v, Set<V>(1e-300));
  const Mask<V> sound = (slope > 0.2) & (slope < 50);
  return {Select(sound, slope, Set<V>(2 * a.n + 1)), sound};
}

template <class V>
GROUSER_INLINE V FirstAngle(const BekkerLaw<double>& a, const Motion<V>& m, V load,
                            const BekkerRules& rules) {
  // F_z of a uniform profile, b k (z/S)^n sqrt(2 r z) times kProfile.
  constexpr double kProfile = 0.7;
  const V stiffness =
      Log(Set<V>(kProfile * a.width)) + 0.5 * Log(Set<V>(2 * a.radius)) + a.log_modulus;
  const V log_z = (Log(load) - stiffness - m.log_ease) * (1 / (a.n + 0.5));
  const V z = Exp(Min(Max(log_z, Set<V>(-200)), Set<V>(200)));
  V theta = Min(Sqrt(2.0 * z * (1 / a.radius)), Set<V>(a.theta_max));
  for (const QuadratureRule& rule : rules.first) {
    const Dual<V, 1> f_z = VerticalForce(a, m, Dual<V, 1>{theta, {Set<V>(1)}}, rule);
    const V step = -LogRatio(f_z.v, load) / SlopeOf(a, f_z, theta).slope;
    theta = theta * Exp(Min(Max(step, Set<V>(-10)), Set<V>(0.25)));
    theta = Min(theta, Set<V>(a.theta_max));
  }
  return theta;
}

/// One step of the lanes that are not settled.
template <class V>
GROUSER_INLINE void Step(const BekkerLaw<double>& a, const Motion<V>& m, V load,
                         const QuadratureRule& rule, int count, Search<V>* s) {
  const Dual<V, 1> f_z = VerticalForce(a, m, Dual<V, 1>{s->theta, {Set<V>(1)}}, rule);
  const LogSlope<V> rise = SlopeOf(a, f_z, s->theta);
  const V f = LogRatio(f_z.v, load), most = Set<V>(a.theta_max);
  const Mask<V> open = !s->settled, below = f < 0, above = !below;
  s->low = Select(open & below, s->theta, s->low);
  s->f_low = Select(open & below, f, s->f_low);
  s->high = Select(open & above, s->theta, s->high);
  s->f_high = Select(open & above, f, s->f_high);
  s->steps = Select(open, s->steps + 1.0, s->steps);
  const Mask<V> over = open & (s->low >= most) & (f < -kExact);
  const Mask<V> closed = (s->high > 0) & (s->low > 0) & (s->high - s->low <= 1e-15 * s->high);
  const Mask<V> near = rise.sound & (Abs(f) <= kNear) & (s->theta < most);
  s->overload = s->overload | over;
  const Mask<V> stays = open & ((Abs(f) <= kExact) | over | closed);

  // At most a factor 1.6 in sinkage a step upwards: the first crossing is the balance.
  // Where F_z hardly grows, longer and longer steps bracket it.
  const Mask<V> no_high = s->high <= 0, no_low = s->low <= 0, both = !(no_high | no_low);
  const double longer = count < 4 ? 1 : count < 60 ? static_cast<double>(1ll << (count - 3)) : 1e18;
  const V stride = Select(both, Set<V>(1), Set<V>(longer));
  const V step = Min(Max(-f * stride / rise.slope, Set<V>(-10)), Set<V>(0.235));
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
  // One that is near takes Newton's own step, and is there.
  const V newton = Min(s->theta * Exp(-f / rise.slope), most);
  s->theta = Select(open & !stays, Select(near, newton, next), s->theta);
  s->settled = s->settled | stays | near;
}

template <class V>
GROUSER_INLINE Search<V> Balance(const BekkerLaw<double>& a, const Motion<V>& m, V load,
                                 const BekkerRules& rules) {
  Search<V> s{};
  s.theta = FirstAngle(a, m, load, rules);
  for (int count = 0; count < kMostSteps && Any<V>(!s.settled); ++count) {
    Step(a, m, load, rules.full, count, &s);
  }
  return s;
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
  e.of[kSinkage].v = Select(s.overload, Set<V>(kMostSinkage * a.radius), e.of[kSinkage].v);
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

/// What is written of an output: its value, and where N > 0 its gradient.
template <class V, int N>
GROUSER_INLINE void Write(const Kinematics<Dual<V, N + 1>>& k, const Equilibrium<V, N>& e,
                          const Search<V>& s, StateBlock* block, int at) {
  const V one = Set<V>(1);
  const V sign[kOutputs] = {k.sign_x, k.sign_y, one, k.sign_x, k.sign_x * k.sign_y, one};
  const V turn[kOutputs] = {k.mirror_x, k.mirror_y, one, k.mirror_x, k.mirror_x * k.mirror_y, one};
  for (int o = 0; o < kOutputs; ++o) {
    Store(&block->value[o][at], e.of[o].v * sign[o] + 0.0);
    for (int i = 0; i < N; ++i) {
      Store(&block->gradient[o][i][at], e.of[o].d[i] * turn[o] + 0.0);
    }
    if (N > 0) Store(&block->gradient[o][N][at], e.by_load[o] * sign[o] + 0.0);
  }
  Store(&block->overload[at], Select(s.overload, one, V{}));
  Store(&block->steps[at], s.steps);
}

/// Solves the lanes of a block from `at`, as many as V has.
template <class V, bool kGradients>
GROUSER_INLINE void SolveLanes(const BekkerLaw<double>& a, const BekkerRules& rules,
                               StateBlock* block, int at) {
  constexpr int kDirections = kGradients ? kInputs - 1 : 0;
  using T = Dual<V, kDirections + 1>;  // the last: theta_f
  const V load = Load<V>(&block->load[at]), v_x = Load<V>(&block->v_x[at]);
  const V v_y = Load<V>(&block->v_y[at]), rim = Load<V>(&block->rim_speed[at]);
  const Kinematics<V> plain = Canonicalise<V>(v_x, v_y, rim);
  const Motion<V> motion = MakeMotion(a, plain.p, plain.y, plain.q);
  const Search<V> s = Balance(a, motion, load, rules);
  const T theta = Seed<T>(s.theta, kDirections, Set<V>(1));
  if constexpr (kGradients) {
    const Kinematics<T> k = Canonicalise<T>(v_x, v_y, rim);
    const auto f = AllForces(a, MakeMotion(a, k.p, k.y, k.q), theta, rules.full, true);
    Write(k, Close<kDirections>(a, f, s, load), s, block, at);
  } else {
    const bool sideways = Any<V>((v_y < 0) | (v_y > 0));
    const auto f = AllForces(a, motion, theta, rules.full, sideways);
    const Kinematics<T> k{{}, {}, {}, plain.sign_x, plain.sign_y, plain.mirror_x, plain.mirror_y};
    Write(k, Close<kDirections>(a, f, s, load), s, block, at);
  }
}

}  // namespace grouser::surrogate::bekker
