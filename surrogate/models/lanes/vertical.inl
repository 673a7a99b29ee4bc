// F_z and its slope with the entry angle: all that the balance needs.
#pragma once

#include "surrogate/models/lanes/motion.inl"

namespace grouser::surrogate::GROUSER_ISA_NS {

// Constants of j over K at a point: j_t = zero - forward sin + spin theta,
// j_y = side_zero - side theta; _d: derivative with theta_f of the constant.
struct Displacement {
  V zero, zero_d, forward, spin, side_zero, side_zero_d, side;
};

template <int N>
GROUSER_LANE_INLINE Displacement MakeDisplacement(const Motion<N>& m, V theta_f) {
  const V ahead = 0.5 + 0.5 * m.t.v, behind = 0.5 - 0.5 * m.t.v;
  const Angle entry = SinCos(theta_f * m.entry.v), exit = SinCos(theta_f * m.exit.v);
  const V sines = ahead * entry.sin + behind * exit.sin;
  const V sines_d = ahead * m.entry.v * entry.cos + behind * m.exit.v * exit.cos;
  const V angles_d = ahead * m.entry.v + behind * m.exit.v, angles = theta_f * angles_d;
  return {m.forward.v * sines - m.spin.v * angles,
          m.forward.v * sines_d - m.spin.v * angles_d,
          m.forward.v * m.t.v,
          m.spin.v * m.t.v,
          m.lateral.v * angles,
          m.lateral.v * angles_d,
          m.lateral.v * m.t.v};
}

// Pressure at a node, common to both branches, and the strength of the shear.
struct Pressure {
  V sigma, per_height;     // d sigma/dh
  V strength, strength_d;  // of the shear, and d strength/d sigma
};

GROUSER_LANE_INLINE Pressure PressureAt(const LaneModel& a, V height, V log_modulus) {
  const V h = Max(height, Set(1e-200)), inverse = 1.0 / h;
  Pressure p;
  p.sigma = Exp(a.n * Log(h) + log_modulus);
  p.per_height = a.n * p.sigma * inverse;
  p.strength = a.friction * p.sigma;
  p.strength_d = Set(a.friction);
  if (a.cohesion > 0) {
    const V rest = Exp(-a.inv_cohesion * p.sigma);
    p.strength = p.strength + a.cohesion * (1.0 - rest);
    p.strength_d = p.strength_d + rest;
  }
  return p;
}

// Mobilised share of the strength at displacement j/K = (t, y): the vector
// (1 - e^-x)/x (t, y), x = |j/K|; `rest` = e^-x, `rate` = (1 - e^-x)/x and the
// unit vector give its derivative, rate dj + (rest - rate) unit (unit . dj).
struct Mobilised {
  V unit_t, unit_y, rate, rest;
};

GROUSER_LANE_INLINE Mobilised Mobilise(V t, V y) {
  const V x = Sqrt(t * t + y * y + 1e-16), inverse = 1.0 / x;  // regular at 0
  Mobilised m;
  m.unit_t = t * inverse;
  m.unit_y = y * inverse;
  m.rest = Exp(-x);
  m.rate = (1.0 - m.rest) * inverse;
  return m;
}

struct Vertical {
  V f_z, slope;  // [N], [N/rad]
};

template <int N>
GROUSER_LANE_INLINE Vertical VerticalForce(const LaneModel& a, const Motion<N>& m, V theta_f,
                                           const LaneRule& rule) {
  const Displacement j = MakeDisplacement(m, theta_f);
  const Angle f = SinCos(theta_f);
  const V sinkage = 2 * a.radius * f.half_sin2, log_modulus = a.log_modulus + m.log_ease.v;
  const V start[2] = {m.entry.v, -m.exit.v};
  const V span[2] = {m.peak.v - m.entry.v, m.peak.v + m.exit.v};
  V sum{}, sum_d{};
  for (int i = 0; i < rule.points; ++i) {
    const V ratio = 1.0 - (1.0 - m.mapped.v) * rule.node[i];
    const Angle phi = SinCos(theta_f * ratio);
    const Pressure p = PressureAt(a, sinkage - 2 * a.radius * phi.half_sin2, log_modulus);
    const V sigma_d = p.per_height * a.radius * (f.sin - phi.sin * ratio);
    const V strength_d = p.strength_d * sigma_d;
    for (int branch = 0; branch < 2; ++branch) {
      const V share = start[branch] + span[branch] * rule.node[i];  // theta / theta_f
      const Angle at = SinCos(theta_f * share);
      const V j_t = j.zero - j.forward * at.sin + j.spin * (theta_f * share);
      const V j_y = j.side_zero - j.side * (theta_f * share);
      const V j_t_d = j.zero_d + (j.spin - j.forward * at.cos) * share;
      const V j_y_d = j.side_zero_d - j.side * share;
      const Mobilised s = Mobilise(j_t, j_y);
      const V share_t = s.rate * j_t;
      const V share_d =
          s.rate * j_t_d + (s.rest - s.rate) * s.unit_t * (s.unit_t * j_t_d + s.unit_y * j_y_d);
      const V tau = -a.traction * p.strength * share_t;
      const V tau_d = -a.traction * (strength_d * share_t + p.strength * share_d);
      const V length = rule.weight[i] * (branch == 0 ? -span[0] : span[1]);
      sum += length * (tau * at.sin + p.sigma * at.cos);
      sum_d += length * ((tau_d - p.sigma * share) * at.sin + (tau * share + sigma_d) * at.cos);
    }
  }
  const V area = a.width * a.radius * theta_f;
  return {area * sum, a.width * a.radius * sum + area * sum_d};
}

}  // namespace grouser::surrogate::GROUSER_ISA_NS
