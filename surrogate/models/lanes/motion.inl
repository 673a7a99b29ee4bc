// What the kinematics alone determine: BekkerModel::MakeMotion in lanes, with
// derivatives along two tangents of the canonical sphere.
#pragma once

#include "surrogate/models/bekker_lanes.h"
#include "surrogate/models/lanes/dual.inl"

namespace grouser::surrogate::GROUSER_ISA_NS {

// p, y, q of Canonical. They are homogeneous of degree 0 in the velocities, so
// they move on a surface: tangent 0 and 1 are (-y, p, 0) and (0, 0, 1) where the
// hub is the faster, (1, 0, 0) and (0, 1, 0) where the rim is. along[i][k]: how
// far velocity component i (v_x, v_y, rim) moves the state along tangent k.
template <int N>
struct Kinematics {
  Dual<N> p, y, q;
  V along[3][2];
  V sign_x, sign_y;      // mirrors of the values, 0 where symmetry makes them 0
  V mirror_x, mirror_y;  // the same for gradients: never 0
};

template <int N>
GROUSER_LANE_INLINE Kinematics<N> Canonicalise(V v_x, V v_y, V rim) {
  Kinematics<N> s;
  const V largest = Max(Max(Abs(v_x), Abs(v_y)), Abs(rim));
  const Mask still = largest == 0;
  const V scale = still ? Set(1) : largest;
  const V x = v_x / scale, y = v_y / scale, u = rim / scale;
  const V hub = Sqrt(x * x + y * y);
  const Mask rim_faster = Abs(u) > hub;
  const V most = still ? Set(1) : Max(Abs(u), hub);
  const Mask backward = (v_x < 0) | ((v_x == 0) & (rim < 0));
  s.mirror_x = backward ? Set(-1) : Set(1);
  s.mirror_y = v_y < 0 ? Set(-1) : Set(1);
  s.sign_x = (v_x == 0) & (rim == 0) ? V{} : s.mirror_x;
  s.sign_y = v_y == 0 ? V{} : s.mirror_y;
  const V p = s.mirror_x * x / most, l = Abs(y) / most, q = s.mirror_x * u / most;
  s.p = Constant<N>(p);
  s.y = Constant<N>(l);
  s.q = Constant<N>(q);
  if constexpr (N == 2) {
    s.p.d[0] = rim_faster ? Set(1) : -l;
    s.y.d[0] = rim_faster ? V{} : p;
    s.y.d[1] = rim_faster ? Set(1) : V{};
    s.q.d[1] = rim_faster ? V{} : Set(1);
    const V unit = still ? V{} : 1.0 / (scale * most);
    s.along[0][0] = (rim_faster ? Set(1) : -l) * unit;
    s.along[0][1] = (rim_faster ? V{} : -q * p) * unit;
    s.along[1][0] = (rim_faster ? V{} : p) * unit;
    s.along[1][1] = (rim_faster ? Set(1) : -q * l) * unit;
    s.along[2][0] = (rim_faster ? -p * q : V{}) * unit;  // q = +-1 there
    s.along[2][1] = (rim_faster ? -l * q : Set(1)) * unit;
  }
  return s;
}

// Angles as multiples of theta_f; displacements per radian, over K.
template <int N>
struct Motion {
  Dual<N> t, entry, exit, peak, mapped;  // theta_1, theta_2, theta_m, theta_a
  Dual<N> log_ease;                      // -n ln S
  Dual<N> forward, spin, lateral;        // r/(w K) times p, e q, y
  Dual<N> front, back;                   // braking slip, running forward and backward
};

template <int N>
GROUSER_LANE_INLINE Motion<N> MakeMotion(const LaneModel& a, const Kinematics<N>& s) {
  Motion<N> m;
  const Dual<N> x = a.inv_turn_speed * (s.p + a.turn_spin * s.q);
  const V inverse = 1.0 / Sqrt(1.0 + x.v * x.v);
  m.t = Chain(x, x.v * inverse, inverse * inverse * inverse);
  const Dual<N> ahead = 0.5 + 0.5 * m.t, behind = 0.5 + -0.5 * m.t;
  const Dual<N> slip = s.q - s.p;
  m.front = Positive(-slip);
  m.back = Positive(slip);
  const Dual<N> drive = m.back * ahead + m.front * behind;
  const Dual<N> brake = m.front * ahead + m.back * behind;
  m.log_ease =
      -a.n * (a.sinkage_drive * drive + a.sinkage_brake * brake + a.sinkage_lateral * (s.y * s.y));
  const Dual<N> raised = SmoothMax(a.c1 + a.c2 * (slip * m.t), Constant<N>(Set(0.02)));
  const Dual<N> peak = -SmoothMax(-raised, Constant<N>(Set(-0.9)));
  m.peak = peak * m.t;
  m.mapped = m.peak * m.t;
  m.entry = a.c3 + (1 - a.c3) * ahead;
  m.exit = a.c3 + (1 - a.c3) * behind;
  const Dual<N> per_travel = (a.radius * a.inv_shear) * Reciprocal(SmoothMax(Abs(s.p), Abs(s.q)));
  m.forward = per_travel * s.p;
  m.spin = a.traction * (per_travel * s.q);
  m.lateral = per_travel * s.y;
  return m;
}

}  // namespace grouser::surrogate::GROUSER_ISA_NS
