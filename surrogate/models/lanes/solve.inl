// The load balance of a block: two Newton steps with few points land within
// 1e-5 of it (99 of 100 lanes: 5e-5), so that all outputs are computed there and
// a linear step ends it; lanes that are further off take a bracketed iteration.
#pragma once

#include "surrogate/models/lanes/forces.inl"

namespace grouser::surrogate::GROUSER_ISA_NS {

constexpr int kMostSteps = 100;
constexpr double kAccepted = 1e-4;  // |ln(F_z/load)| that the linear step corrects
constexpr double kExact = 1e-9;     // where the iteration ends

// In ln theta_f, on ln(F_z/load), which is nearly a straight line.
struct Search {
  V theta, low, high, f_low, f_high;  // bracket; 0: not yet known
  Mask settled, overload;
  V steps;
};

GROUSER_LANE_INLINE V LogRatio(V f_z, V load) { return Log(Max(f_z / load, Set(1e-12))); }

// d ln F_z/d ln theta_f, or that of a uniform profile where it makes no sense.
GROUSER_LANE_INLINE V LogSlope(const LaneModel& a, const Vertical& at, V theta) {
  const V slope = at.slope * theta / Max(at.f_z, Set(1e-300));
  return (slope > 0.2) & (slope < 50) ? slope : Set(2 * a.n + 1);
}

template <int N>
GROUSER_LANE_INLINE V FirstAngle(const LaneModel& a, const Motion<N>& m, V load) {
  // F_z = guess z^(n + 1/2) on the ground that slip has eased.
  const V log_z = (Log(load) - a.log_guess - m.log_ease.v) * (1 / (a.n + 0.5));
  const V z = Exp(Min(Max(log_z, Set(-200)), Set(200)));
  V theta = Min(Sqrt(2.0 * z * (1 / a.radius)), Set(a.theta_max));
  for (const LaneRule& rule : a.first_rules) {
    const Vertical at = VerticalForce(a, m, theta, rule);
    const V step = -LogRatio(at.f_z, load) / LogSlope(a, at, theta);
    theta = theta * Exp(Min(Max(step, Set(-10)), Set(0.25)));
    theta = Min(theta, Set(a.theta_max));
  }
  return theta;
}

// 2^n; no library code here, which the linker might share between sets.
GROUSER_LANE_INLINE double Doubled(int n) { return n < 60 ? static_cast<double>(1ll << n) : 1e18; }

// One step of the lanes that are not settled.
template <int N>
GROUSER_LANE_INLINE void Step(const LaneModel& a, const Motion<N>& m, V load, int count,
                              Search* s) {
  const Vertical at = VerticalForce(a, m, s->theta, a.rule);
  const V f = LogRatio(at.f_z, load);
  const Mask open = ~s->settled, below = f < 0;
  s->low = open & below ? s->theta : s->low;
  s->f_low = open & below ? f : s->f_low;
  s->high = open & ~below ? s->theta : s->high;
  s->f_high = open & ~below ? f : s->f_high;
  s->steps = open ? s->steps + 1.0 : s->steps;
  const Mask over = open & (s->low >= a.theta_max) & (f < -kExact);
  const Mask closed = (s->high > 0) & (s->low > 0) & (s->high - s->low <= 1e-15 * s->high);
  s->overload |= over;
  const Mask here = (Abs(f) <= kExact) | over | closed;

  // At most a factor 1.6 in sinkage a step upwards: the first crossing is the balance.
  // Where F_z hardly grows, longer and longer steps bracket it.
  const Mask no_high = s->high == 0, no_low = s->low == 0, both = ~(no_high | no_low);
  const V stride = both ? Set(1) : Set(count < 4 ? 1 : Doubled(count - 3));
  const V step = Min(Max(-f * stride / LogSlope(a, at, s->theta), Set(-10)), Set(0.235));
  V next = s->theta * Exp(step);
  next = no_high ? Min(next, Set(a.theta_max)) : next;
  next = no_low & (next >= s->high) ? 0.5 * s->high : next;
  const Mask lost = both & ((next <= s->low) | (next >= s->high));
  if (count >= 8 || Any(open & lost)) {
    // False position and bisection in turn: the bracket shrinks whatever F_z does.
    const V share = count % 2 == 0 ? s->f_low / (s->f_low - s->f_high) : Set(0.5);
    const Mask replace = count >= 8 ? both : lost;
    const V ratio = both ? s->high / s->low : Set(1);
    next = replace ? s->low * Exp(share * Log(ratio)) : next;
  }
  const Mask moves = open & ~here;
  s->theta = moves ? next : s->theta;
  s->settled |= here;
}

template <int N>
GROUSER_LANE_INLINE void Write(const LaneModel& a, const Kinematics<N - 1>& k, const Forces<N>& f,
                               V load, const Search& s, StateBlock* block, int at) {
  const V none{}, one = Set(1);
  const V sign[kOutputs] = {k.sign_x, k.sign_y, one, k.sign_x, k.sign_x * k.sign_y, one};
  const Dual<N>& f_z = f.of[kFz];
  // Rising where it crosses the load for the first time; the floor is for rounding.
  const V slope = Max(f_z.d[0], 1e-6 * Abs(f_z.v));
  const V per_newton = s.overload ? none : 1.0 / slope;  // d theta_f/d load
  const V rest = Min((load - f_z.v) * per_newton, a.theta_max - s.theta);
  for (int o = 0; o < kOutputs; ++o) {
    Store(&block->value[o][at], (f.of[o].v + f.of[o].d[0] * rest) * sign[o] + 0.0);
  }
  Store(&block->overload[at], s.overload ? one : none);
  Store(&block->iterations[at], s.steps);
  if constexpr (N == 3) {
    const V turn[kOutputs] = {k.mirror_x, k.mirror_y, one, k.mirror_x, k.mirror_x * k.mirror_y,
                              one};
    const V mirror[3] = {k.mirror_x, k.mirror_y, k.mirror_x};
    for (int o = 0; o < kOutputs; ++o) {
      const V with_angle = f.of[o].d[0];
      const V first = f.of[o].d[1] - with_angle * per_newton * f_z.d[1];
      const V second = f.of[o].d[2] - with_angle * per_newton * f_z.d[2];
      for (int i = 0; i < 3; ++i) {
        const V moved = first * k.along[i][0] + second * k.along[i][1];
        const V exact = (o == kFz) ? (s.overload ? moved : none) : moved;
        Store(&block->gradient[o][i][at], exact * turn[o] * mirror[i] + 0.0);
      }
      Store(&block->gradient[o][3][at], with_angle * per_newton * sign[o] + 0.0);
    }
  }
}

template <bool kGradients>
GROUSER_LANE_INLINE void SolveLanes(const LaneModel& a, StateBlock* block, int at) {
  constexpr int kTangents = kGradients ? 2 : 0;
  const V load = Load(&block->load[at]), v_y = Load(&block->v_y[at]);
  const auto kinematics =
      Canonicalise<kTangents>(Load(&block->v_x[at]), v_y, Load(&block->rim_speed[at]));
  const auto motion = MakeMotion(a, kinematics);
  Search s{};
  s.theta = FirstAngle(a, motion, load);
  const bool sideways = Any(v_y != 0);
  auto forces = AllForces<kTangents + 1>(a, motion, s.theta, sideways);
  // Near a fold, where F_z hardly grows with the sinkage, the step would be long.
  const Dual<kTangents + 1>& f_z = forces.of[kFz];
  const V steepness = Min(f_z.d[0] * s.theta / Max(Abs(f_z.v), Set(1e-300)), Set(1));
  const V f = LogRatio(f_z.v, load);
  s.settled = (Abs(f) <= kAccepted * steepness) & (s.theta <= a.theta_max * (1 - kAccepted));
  if (Any(~s.settled)) {
    for (int count = 0; count < kMostSteps && Any(~s.settled); ++count) {
      Step(a, motion, load, count, &s);
    }
    forces = AllForces<kTangents + 1>(a, motion, s.theta, sideways);
  }
  Write<kTangents + 1>(a, kinematics, forces, load, s, block, at);
}

void SolveBlock(const LaneModel& a, bool gradients, StateBlock* block) noexcept {
  for (int at = 0; at < kBlock; at += GROUSER_LANES) {
    if (gradients) {
      SolveLanes<true>(a, block, at);
    } else {
      SolveLanes<false>(a, block, at);
    }
  }
}

}  // namespace grouser::surrogate::GROUSER_ISA_NS
