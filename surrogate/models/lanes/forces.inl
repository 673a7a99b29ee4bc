// All forces at a given entry angle with their derivatives: [0] with theta_f,
// and with gradients [1], [2] along the tangents of the kinematics.
#pragma once

#include "surrogate/models/lanes/vertical.inl"

namespace grouser::surrogate::GROUSER_ISA_NS {

// From derivatives along the tangents alone to those with theta_f in front.
template <int N>
GROUSER_LANE_INLINE Dual<N + 1> Lift(const Dual<N>& a) {
  Dual<N + 1> r;
  r.v = a.v;
  r.d[0] = V{};
  for (int k = 0; k < N; ++k) r.d[k + 1] = a.d[k];
  return r;
}

// The terms of Displacement, with all derivatives.
template <int N>
struct Contact {
  Dual<N> theta_f, entry, exit, peak, drop, sinkage, log_ease;
  Dual<N> zero, forward, spin, side_zero, side;
};

template <int N>
GROUSER_LANE_INLINE Contact<N> MakeContact(const LaneModel& a, const Motion<N - 1>& m, V theta_f) {
  Contact<N> c;
  c.theta_f = Constant<N>(theta_f);
  c.theta_f.d[0] = Set(1);
  c.entry = c.theta_f * Lift(m.entry);
  c.exit = c.theta_f * Lift(m.exit);
  c.peak = c.theta_f * Lift(m.peak);
  c.drop = c.theta_f * (1.0 + -1.0 * Lift(m.mapped));
  const Angle f = SinCos(theta_f), one = SinCos(c.entry.v), two = SinCos(c.exit.v);
  c.sinkage = Chain(c.theta_f, 2 * a.radius * f.half_sin2, a.radius * f.sin);
  c.log_ease = Lift(m.log_ease);
  const Dual<N> t = Lift(m.t), ahead = 0.5 + 0.5 * t, behind = 0.5 + -0.5 * t;
  const Dual<N> forward = Lift(m.forward), spin = Lift(m.spin), lateral = Lift(m.lateral);
  const Dual<N> sines =
      ahead * Chain(c.entry, one.sin, one.cos) + behind * Chain(c.exit, two.sin, two.cos);
  const Dual<N> angles = ahead * c.entry + behind * c.exit;
  c.zero = forward * sines - spin * angles;
  c.forward = forward * t;
  c.spin = spin * t;
  c.side_zero = lateral * angles;
  c.side = lateral * t;
  return c;
}

template <int N>
struct Node {
  Pressure p;
  V sigma_d[N];
};

template <int N>
GROUSER_LANE_INLINE void MakeNodes(const LaneModel& a, const Contact<N>& c, Node<N>* nodes) {
  const Angle f = SinCos(c.theta_f.v);
  const V log_modulus = a.log_modulus + c.log_ease.v;
  for (int i = 0; i < a.rule.points; ++i) {
    const Angle phi = SinCos(c.theta_f.v - c.drop.v * a.rule.node[i]);
    Node<N>& n = nodes[i];
    n.p = PressureAt(a, c.sinkage.v - 2 * a.radius * phi.half_sin2, log_modulus);
    for (int k = 0; k < N; ++k) {
      const V phi_d = c.theta_f.d[k] - c.drop.d[k] * a.rule.node[i];
      n.sigma_d[k] = n.p.per_height * a.radius * (f.sin * c.theta_f.d[k] - phi.sin * phi_d) +
                     n.p.sigma * c.log_ease.d[k];
    }
  }
}

// Terms of one branch per unit of weight: f_x, f_y, f_z, torque, m_z, before
// the common factors of Finish. theta = start + span x.
template <int N, bool kSideways>
GROUSER_LANE_INLINE void AddBranch(const LaneModel& a, const Contact<N>& c, const Node<N>* nodes,
                                   const Dual<N>& start, const Dual<N>& span, const Dual<N>& length,
                                   Dual<N> (&total)[5]) {
  V sum[5] = {}, sum_d[5][N] = {};
  const double e = a.traction;
  for (int i = 0; i < a.rule.points; ++i) {
    const Node<N>& n = nodes[i];
    const double w = a.rule.weight[i];
    const V theta = start.v + span.v * a.rule.node[i];
    const Angle at = SinCos(theta);
    const V j_t = c.zero.v - c.forward.v * at.sin + c.spin.v * theta;
    const V j_y = c.side_zero.v - c.side.v * theta;
    const Mobilised s = Mobilise(j_t, j_y);
    const V share_t = s.rate * j_t, share_y = s.rate * j_y;
    const V tau_t = -e * n.p.strength * share_t, tau_y = -e * n.p.strength * share_y;
    const V depth = Max(c.sinkage.v - 2 * a.radius * (at.half_sin2), V{});
    const V upright = Max(at.cos, V{});
    const V passive = (a.side_square * depth + a.side_linear) * depth;
    // e^-x of the side's own travel; where nothing moves sideways it is 1.
    const V rest = kSideways ? Exp(-a.shear_over_bulldozing * j_y) : Set(1);
    const V side = passive * upright * (1.0 - rest);
    const V lateral = a.width * tau_y - side, turning = a.width * e * tau_y - side;
    sum[kFx] += w * (tau_t * at.cos - n.p.sigma * at.sin);
    sum[kFy] += w * lateral;
    sum[kFz] += w * (tau_t * at.sin + n.p.sigma * at.cos);
    sum[kTorque] += w * tau_t;
    sum[kMz] += w * (turning * at.sin);

    const V spread = s.rest - s.rate;
    const V slope_t = c.spin.v - c.forward.v * at.cos;
    const V passive_d = (2 * a.side_square * depth + a.side_linear) * upright * (1.0 - rest);
    const V upright_d = at.cos > 0 ? -at.sin * passive * (1.0 - rest) : V{};
    const V travel_d = passive * upright * rest * a.shear_over_bulldozing;
    for (int k = 0; k < N; ++k) {
      const V theta_d = start.d[k] + span.d[k] * a.rule.node[i];
      const V j_t_d =
          c.zero.d[k] - c.forward.d[k] * at.sin + c.spin.d[k] * theta + slope_t * theta_d;
      const V j_y_d = c.side_zero.d[k] - c.side.d[k] * theta - c.side.v * theta_d;
      const V along = spread * (s.unit_t * j_t_d + s.unit_y * j_y_d);
      const V strength_d = n.p.strength_d * n.sigma_d[k];
      const V tau_t_d =
          -e * (strength_d * share_t + n.p.strength * (s.rate * j_t_d + s.unit_t * along));
      const V tau_y_d =
          -e * (strength_d * share_y + n.p.strength * (s.rate * j_y_d + s.unit_y * along));
      const V depth_d = c.sinkage.d[k] - a.radius * at.sin * theta_d;
      const V side_d = passive_d * depth_d + upright_d * theta_d + travel_d * j_y_d;
      sum_d[kFx][k] += w * ((tau_t_d - n.p.sigma * theta_d) * at.cos -
                            (tau_t * theta_d + n.sigma_d[k]) * at.sin);
      sum_d[kFy][k] += w * (a.width * tau_y_d - side_d);
      sum_d[kFz][k] += w * ((tau_t_d - n.p.sigma * theta_d) * at.sin +
                            (tau_t * theta_d + n.sigma_d[k]) * at.cos);
      sum_d[kTorque][k] += w * tau_t_d;
      sum_d[kMz][k] += w * ((a.width * e * tau_y_d - side_d) * at.sin + turning * at.cos * theta_d);
    }
  }
  for (int o = 0; o < 5; ++o) {
    total[o].v += length.v * sum[o];
    for (int k = 0; k < N; ++k) {
      total[o].d[k] += length.d[k] * sum[o] + length.v * sum_d[o][k];
    }
  }
}

// Heap that a braked rim pushes, against the motion and through the axle.
template <int N>
GROUSER_LANE_INLINE Dual<N> Blade(const LaneModel& a, const Contact<N>& c, const Motion<N - 1>& m) {
  const Dual<N> t = Lift(m.t);
  const Dual<N> travel = (a.radius * a.inv_bulldozing) * c.theta_f;
  const Dual<N> passive = a.width * (c.sinkage * (a.front_linear + a.front_square * c.sinkage));
  const Dual<N> ahead = 1.0 + -1.0 * Exp(-(travel * Lift(m.front)));
  const Dual<N> behind = 1.0 + -1.0 * Exp(-(travel * Lift(m.back)));
  return passive * (ahead * (0.5 + 0.5 * t) - behind * (0.5 + -0.5 * t));
}

template <int N>
struct Forces {
  Dual<N> of[kOutputs];
};

// Outputs in the canonical half-space.
template <int N>
GROUSER_LANE_INLINE Forces<N> AllForces(const LaneModel& a, const Motion<N - 1>& m, V theta_f,
                                        bool sideways) {
  const Contact<N> c = MakeContact<N>(a, m, theta_f);
  Node<N> nodes[kMostPoints];
  MakeNodes(a, c, nodes);
  Dual<N> total[5] = {};
  const Dual<N> front = c.entry - c.peak, rear = c.exit + c.peak;
  if (sideways) {
    AddBranch<N, true>(a, c, nodes, c.entry, -front, front, total);
    AddBranch<N, true>(a, c, nodes, -c.exit, rear, rear, total);
  } else {
    AddBranch<N, false>(a, c, nodes, c.entry, -front, front, total);
    AddBranch<N, false>(a, c, nodes, -c.exit, rear, rear, total);
  }
  const double r = a.radius, area = a.width * r;
  Forces<N> f;
  f.of[kFx] = area * total[kFx] - Blade(a, c, m);
  f.of[kFy] = r * total[kFy];
  f.of[kFz] = area * total[kFz];
  f.of[kTorque] = (area * r * a.traction) * total[kTorque];
  f.of[kMz] = (r * r) * total[kMz];
  f.of[kSinkage] = c.sinkage;
  return f;
}

}  // namespace grouser::surrogate::GROUSER_ISA_NS
