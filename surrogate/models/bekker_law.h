#pragma once

#include "surrogate/models/dual.h"
#include "surrogate/models/quadrature.h"
#include "surrogate/models/wheel_model.h"

/// The equations of BekkerModel, once, for any number: P of the soil's parameters,
/// M of the motion, T of what depends on the sinkage as well. Values: double alone,
/// or packs for M and T; derivatives: Dual of either (dual.h), for P too.
namespace grouser::surrogate {

/// Sinkage beyond which no balance is sought, over the radius.
inline constexpr double kMostSinkage = 1.2;

/// Constants of the equations (bekker::MakeLaw).
template <class P>
struct BekkerLaw {
  double radius, width, theta_max;  // theta_max: entry angle at the largest sinkage
  P log_modulus, n;                 // ln k; n
  P cohesion, inv_cohesion, friction;
  bool cohesive;  // whether adhesion has a share, or a derivative
  P inv_shear, shear_over_bulldozing, inv_bulldozing;
  P c1, c2, c3, sinkage_drive, sinkage_brake, sinkage_lateral;
  P turn_spin, inv_turn_speed;
  P side_square, side_linear, front_square, front_linear;  // R(h) = square h^2 + linear h
  P traction;                                              // e, shearing radius over r
};

namespace bekker {

inline constexpr double kCorner = 0.05;  // width of the smooth corners

/// max(0, x) with a continuous slope.
template <class T>
GROUSER_INLINE T Positive(const T& x) {
  const T up = Max(x, Constant<T>(Base<T>{}));
  return up * up / (up + kCorner);
}

template <class T>
GROUSER_INLINE T SmoothMax(const T& a, const T& b) {
  const T gap = a - b;
  return 0.5 * (a + b + Sqrt(gap * gap + kCorner * kCorner));
}

/// What the kinematics alone determine. Angles as multiples of theta_f;
/// displacements per radian, over K.
template <class M>
struct Motion {
  M t;                          // 1: entry ahead, -1: entry behind
  M entry, exit, peak, mapped;  // theta_1, theta_2, theta_m, theta_a
  M log_ease;                   // -n ln S
  M forward, spin, lateral;     // r/(w K) times p, e q, y
  M front, back;                // braking slip, running forward and backward
};

/// p, y, q: v_x, |v_y| and r w of Canonical.
template <class P, class M>
GROUSER_INLINE Motion<M> MakeMotion(const BekkerLaw<P>& a, const M& p, const M& y, const M& q) {
  Motion<M> m;
  const M x = a.inv_turn_speed * (p + a.turn_spin * q);
  m.t = x / Sqrt(1.0 + x * x);
  const M ahead = 0.5 + 0.5 * m.t, behind = 0.5 - 0.5 * m.t, slip = q - p;
  m.front = Positive<M>(-slip);
  m.back = Positive(slip);
  const M drive = m.back * ahead + m.front * behind;
  const M brake = m.front * ahead + m.back * behind;
  m.log_ease =
      -a.n * (a.sinkage_drive * drive + a.sinkage_brake * brake + a.sinkage_lateral * (y * y));
  // Smoothly kept within (0.02, 0.9).
  const M raised = SmoothMax<M>(a.c1 + a.c2 * (slip * m.t), Constant<M>(Set<Base<M>>(0.02)));
  const M peak = -SmoothMax<M>(-raised, Constant<M>(Set<Base<M>>(-0.9)));
  m.peak = peak * m.t;
  m.mapped = m.peak * m.t;
  m.entry = a.c3 + (1.0 - a.c3) * ahead;
  m.exit = a.c3 + (1.0 - a.c3) * behind;
  const M per_travel = (a.radius * a.inv_shear) / SmoothMax<M>(Abs(p), Abs(q));
  m.forward = per_travel * p;
  m.spin = a.traction * (per_travel * q);
  m.lateral = per_travel * y;
  return m;
}

/// What motion and entry angle determine. Displacement over K at theta:
/// j_t = zero - forward sin theta + spin theta, j_y = side_zero - side theta.
template <class T, class M>
struct Contact {
  T theta_f, sinkage, sin_f, cos_f;
  T entry, exit, peak, half_drop;
  T zero, side_zero;
  M forward, spin, side, log_modulus;
};

template <class P, class T, class M>
GROUSER_INLINE Contact<T, M> MakeContact(const BekkerLaw<P>& a, const Motion<M>& m,
                                         const T& theta_f) {
  Contact<T, M> c;
  const Angle<T> f = SinCos(theta_f);
  c.theta_f = theta_f;
  c.sinkage = (2 * a.radius) * f.half_sin2;
  c.sin_f = f.sin;
  c.cos_f = f.cos;
  c.entry = m.entry * theta_f;
  c.exit = m.exit * theta_f;
  c.peak = m.peak * theta_f;
  c.half_drop = (0.5 - 0.5 * m.mapped) * theta_f;
  const M ahead = 0.5 + 0.5 * m.t, behind = 0.5 - 0.5 * m.t;
  const T angles = ahead * c.entry + behind * c.exit;
  c.zero =
      m.forward * (ahead * SinCos(c.entry).sin + behind * SinCos(c.exit).sin) - m.spin * angles;
  c.side_zero = m.lateral * angles;
  c.forward = m.forward * m.t;
  c.spin = m.spin * m.t;
  c.side = m.lateral * m.t;
  c.log_modulus = a.log_modulus + m.log_ease;
  return c;
}

template <class T>
struct Pressure {
  T sigma, strength;  // [Pa]; strength of the shear
};

/// At `node`: 0 at an edge of the contact, 1 at the peak; of either branch. h
/// without cancellation, as a product of sines.
template <class P, class T, class M, class S>
GROUSER_INLINE Pressure<T> PressureAt(const BekkerLaw<P>& a, const Contact<T, M>& c,
                                      const S& node) {
  const Angle<T> half = SinCos(T(c.half_drop * node));
  const T h = (2 * a.radius) * (half.sin * (c.sin_f * half.cos - c.cos_f * half.sin));
  const T safe = Max(h, Constant<T>(Set<Base<T>>(1e-200)));
  Pressure<T> at;
  at.sigma = Exp(a.n * Log(safe) + c.log_modulus);
  at.strength = a.friction * at.sigma;
  if (a.cohesive) {
    at.strength = at.strength + a.cohesion * Rise(T(a.inv_cohesion * at.sigma));
  }
  return at;
}

template <class T>
struct Shear {
  T tangential, axial;  // [Pa], per area of the rim
  T j_y;                // over K
};

template <class P, class T, class M>
GROUSER_INLINE Shear<T> ShearAt(const BekkerLaw<P>& a, const Contact<T, M>& c, const T& theta,
                                const T& sine, const T& strength) {
  const T j_t = c.zero - c.forward * sine + c.spin * theta;
  Shear<T> s;
  s.j_y = c.side_zero - c.side * theta;
  // Regular at 0, where rounding is all that 1e-16 changes.
  const T taken = a.traction * (strength * DecayMean(Sqrt(j_t * j_t + s.j_y * s.j_y + 1e-16)));
  s.tangential = -(taken * j_t);
  s.axial = -(taken * s.j_y);
  return s;
}

/// Terms of one point, or their sums over one branch, before the common factors of
/// AllForces: f_x, f_y, f_z, torque, m_z; of f_z alone without kAll.
template <class T>
struct Sums {
  T of[5];
};

/// At the point theta. sideways: whether any lane moves so; else f_y and m_z stay 0.
template <bool kAll, class P, class T, class M>
GROUSER_INLINE Sums<T> TermsAt(const BekkerLaw<P>& a, const Contact<T, M>& c, const Pressure<T>& at,
                               const T& theta, bool sideways) {
  const Angle<T> angle = SinCos(theta);
  const Shear<T> tau = ShearAt(a, c, theta, angle.sin, at.strength);
  Sums<T> term{};
  term.of[kFz] = tau.tangential * angle.sin + at.sigma * angle.cos;
  if constexpr (kAll) {
    term.of[kFx] = tau.tangential * angle.cos - at.sigma * angle.sin;
    term.of[kTorque] = tau.tangential;
    if (!sideways) return term;
    const T zero = Constant<T>(Base<T>{});
    const T depth = Max(T(c.sinkage - (2 * a.radius) * angle.half_sin2), zero);
    const T upright = Max(angle.cos, zero);
    const T side = (a.side_square * depth + a.side_linear) * depth * upright *
                   Rise(T(a.shear_over_bulldozing * tau.j_y));
    term.of[kFy] = a.width * tau.axial - side;
    term.of[kMz] = (a.width * (a.traction * tau.axial) - side) * angle.sin;
  }
  return term;
}

/// Whether a sum over the points has output o.
template <bool kAll>
GROUSER_INLINE constexpr bool Summed(int o, bool sideways) {
  return o == kFz || (kAll && (sideways || !(o == kFy || o == kMz)));
}

/// How the points of a contact are summed up: one after the other, in as many lanes as
/// T has states, ...
struct StatesInLanes {};
/// ... or for a single state (T: double or Dual of it) as many at once as Pack has
/// lanes, by the same operations and in the same order: to the same bits.
template <class Pack>
struct PointsInLanes {};

template <bool kAll, class P, class T, class M>
GROUSER_INLINE Sums<T> Integrate(const BekkerLaw<P>& a, const Contact<T, M>& c,
                                 const QuadratureRule& rule, bool sideways, StatesInLanes) {
  constexpr int kSome = 16;  // points between which a processor overlaps short loops
  Sums<T> front{}, rear{};
  Pressure<T> at[kSome];
  const T to_front = c.entry - c.peak, to_rear = c.exit + c.peak;
  const auto add = [&](const Pressure<T>& here, const T& theta, double weight, Sums<T>* sums)
      __attribute__((always_inline)) {
    const Sums<T> term = TermsAt<kAll>(a, c, here, theta, sideways);
    for (int o = 0; o < 5; ++o) {
      if (Summed<kAll>(o, sideways)) sums->of[o] = sums->of[o] + weight * term.of[o];
    }
  };
  for (int first = 0; first < rule.points; first += kSome) {
    const int count = rule.points - first < kSome ? rule.points - first : kSome;
    const double *node = rule.node + first, *weight = rule.weight + first;
    for (int i = 0; i < count; ++i) at[i] = PressureAt(a, c, node[i]);
    for (int i = 0; i < count; ++i) {
      add(at[i], T(c.entry - to_front * node[i]), weight[i], &front);
    }
    for (int i = 0; i < count; ++i) {
      add(at[i], T(to_rear * node[i] - c.exit), weight[i], &rear);
    }
  }
  for (int o = 0; o < 5; ++o) {
    if (kAll || o == kFz) front.of[o] = to_front * front.of[o] + to_rear * rear.of[o];
  }
  return front;
}

/// The same number in every lane.
template <class Pack>
GROUSER_INLINE Pack Spread(double x) {
  return Set<Pack>(x);
}
template <class Pack, int N>
GROUSER_INLINE Dual<Pack, N> Spread(const Dual<double, N>& x) {
  Dual<Pack, N> r;
  r.v = Set<Pack>(x.v);
  GROUSER_EACH(N, r.d[k] = Set<Pack>(x.d[k]));
  return r;
}
/// Adds the first `count` lanes of a term, one after the other.
template <class Pack>
GROUSER_INLINE void AddLanes(Pack term, int count, double* sum) {
  for (int l = 0; l < count; ++l) *sum = *sum + term[l];
}
template <class Pack, int N>
GROUSER_INLINE void AddLanes(const Dual<Pack, N>& term, int count, Dual<double, N>* sum) {
  AddLanes(term.v, count, &sum->v);
  GROUSER_EACH(N, AddLanes(term.d[k], count, &sum->d[k]));
}

template <bool kAll, class P, class T, class M, class Pack>
GROUSER_INLINE Sums<T> Integrate(const BekkerLaw<P>& a, const Contact<T, M>& narrow,
                                 const QuadratureRule& rule, bool sideways, PointsInLanes<Pack>) {
  constexpr int kLanes = sizeof(Pack) / sizeof(double);
  const auto spread = [](const auto& x) __attribute__((always_inline)) { return Spread<Pack>(x); };
  using W = decltype(Spread<Pack>(narrow.entry));
  const Contact<W, decltype(Spread<Pack>(narrow.forward))> c = {
      spread(narrow.theta_f),   spread(narrow.sinkage),    spread(narrow.sin_f),
      spread(narrow.cos_f),     spread(narrow.entry),      spread(narrow.exit),
      spread(narrow.peak),      spread(narrow.half_drop),  spread(narrow.zero),
      spread(narrow.side_zero), spread(narrow.forward),    spread(narrow.spin),
      spread(narrow.side),      spread(narrow.log_modulus)};
  const T to_front = narrow.entry - narrow.peak, to_rear = narrow.exit + narrow.peak;
  const W front_width = Spread<Pack>(to_front), rear_width = Spread<Pack>(to_rear);
  Sums<T> front{}, rear{};
  for (int first = 0; first < rule.points; first += kLanes) {
    const int count = rule.points - first < kLanes ? rule.points - first : kLanes;
    const Pack node = Load<Pack>(rule.node + first), weight = Load<Pack>(rule.weight + first);
    const Pressure<W> at = PressureAt(a, c, node);
    const Sums<W> ahead = TermsAt<kAll>(a, c, at, W(c.entry - front_width * node), sideways);
    const Sums<W> behind = TermsAt<kAll>(a, c, at, W(rear_width * node - c.exit), sideways);
    for (int o = 0; o < 5; ++o) {
      if (!Summed<kAll>(o, sideways)) continue;
      AddLanes(W(weight * ahead.of[o]), count, &front.of[o]);
      AddLanes(W(weight * behind.of[o]), count, &rear.of[o]);
    }
  }
  for (int o = 0; o < 5; ++o) {
    if (kAll || o == kFz) front.of[o] = to_front * front.of[o] + to_rear * rear.of[o];
  }
  return front;
}

/// F_z [N] at an entry angle.
template <class P, class T, class M, class How = StatesInLanes>
GROUSER_INLINE T VerticalForce(const BekkerLaw<P>& a, const Motion<M>& m, const T& theta_f,
                               const QuadratureRule& rule, How how = {}) {
  return (a.width * a.radius) *
         Integrate<false>(a, MakeContact(a, m, theta_f), rule, false, how).of[kFz];
}

/// Outputs in the canonical half-space, in the order of Output.
template <class T>
struct Forces {
  T of[kOutputs];
};

/// Heap that a braked rim pushes, against the motion and through the axle.
template <class P, class T, class M>
GROUSER_INLINE T Blade(const BekkerLaw<P>& a, const Contact<T, M>& c, const Motion<M>& m) {
  const T travel = (a.radius * a.inv_bulldozing) * c.theta_f;
  const T passive = a.width * (c.sinkage * (a.front_linear + a.front_square * c.sinkage));
  const T ahead = Rise(T(m.front * travel));
  const T behind = Rise(T(m.back * travel));
  return passive * ((0.5 + 0.5 * m.t) * ahead - (0.5 - 0.5 * m.t) * behind);
}

template <class P, class T, class M, class How = StatesInLanes>
GROUSER_INLINE Forces<T> AllForces(const BekkerLaw<P>& a, const Motion<M>& m, const T& theta_f,
                                   const QuadratureRule& rule, bool sideways, How how = {}) {
  const Contact<T, M> c = MakeContact(a, m, theta_f);
  const Sums<T> sum = Integrate<true>(a, c, rule, sideways, how);
  const double r = a.radius, area = a.width * r;
  Forces<T> f;
  f.of[kFx] = area * sum.of[kFx] - Blade(a, c, m);
  f.of[kFy] = r * sum.of[kFy];
  f.of[kFz] = area * sum.of[kFz];
  f.of[kTorque] = (area * r) * (a.traction * sum.of[kTorque]);
  f.of[kMz] = (r * r) * sum.of[kMz];
  f.of[kSinkage] = c.sinkage;
  return f;
}

/// Stresses on the rim as in RimStress: those that Integrate sums up.
template <class T>
struct Stress {
  T normal, tangential, axial;  // [Pa]
};
/// At `theta`; 0 outside the contact.
template <class P, class T, class M>
GROUSER_INLINE Stress<T> StressAt(const BekkerLaw<P>& a, const Contact<T, M>& c, double theta) {
  if (!(theta < Value(c.entry) && theta > -Value(c.exit))) return {};
  const T node = theta > Value(c.peak) ? T((c.entry - theta) / (c.entry - c.peak))
                                       : T((theta + c.exit) / (c.peak + c.exit));
  const Pressure<T> at = PressureAt(a, c, node);
  const T angle = Constant<T>(theta);
  const Shear<T> tau = ShearAt(a, c, angle, SinCos(angle).sin, at.strength);
  return {at.sigma, tau.tangential, tau.axial};
}

}  // namespace bekker
}  // namespace grouser::surrogate
