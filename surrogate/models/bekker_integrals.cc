#include <cmath>

#include "surrogate/models/bekker.h"
#include "surrogate/models/bekker_motion.h"
#include "surrogate/models/vector_math.h"

// One binary picks its instruction set; every set rounds alike. The resolver
// runs before a sanitizer is ready, so sanitized builds take the plain set.
#if defined(__x86_64__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define GROUSER_CLONES [[gnu::target_clones("avx512f", "avx2", "default")]]
#else
#define GROUSER_CLONES
#endif

namespace grouser::surrogate {

// What state and sinkage determine; all that the law at a point reads.
struct BekkerContact {
  double theta_f, theta_a, theta_1, theta_2, theta_m, half_t, sin_1, sin_2, cos_f;
  double p, q_sheared, traction, y_over_w, r_over_w, radius, inv_k, inv_kb;
  double modulus, n, inv_multiplier, cohesion, inv_cohesion, friction, side_a, side_b, width;
};

namespace {

namespace vm = vector_math;

constexpr int kN = 16;

double Larger(double a, double b) { return a > b ? a : b; }

// All that the point loops read, and where they leave their terms.
struct alignas(64) Work : BekkerContact {
  double node[kN], weight[kN];
  double sigma[kN];        // [Pa], common to both branches
  double strength[kN];     // [Pa], of the shear
  double term[5][2 * kN];  // f_x, f_y, f_z, torque/r, m_z per point
};

// The law at a point, once for integrals and stresses.
struct Pressure {
  double sigma, strength;  // [Pa]; strength of the shear
};
struct Shear {
  double tangential, axial;  // [Pa], per area of the rim
  double j_y;                // [m]
};

// sigma = k (h/S)^n and the shear strength at `node`: 0 at an edge of the contact, 1 at
// the peak; h without cancellation as a product of sines.
GROUSER_INLINE Pressure PressureAt(const BekkerContact& w, double node) {
  const double drop = (w.theta_f - w.theta_a) * node;  // theta_f - phi
  const double h = 2 * w.radius * vm::Sin(w.theta_f - 0.5 * drop) * vm::Sin(0.5 * drop);
  const double safe = h * w.inv_multiplier > 1e-200 ? h * w.inv_multiplier : 1e-200;
  const double sigma = w.modulus * vm::Exp(w.n * vm::Log(safe));
  return {sigma, w.cohesion * (1 - vm::Exp(-sigma * w.inv_cohesion)) + sigma * w.friction};
}

// Shear at theta, whose sine is s.
GROUSER_INLINE Shear ShearAt(const BekkerContact& w, double theta, double s, double limit) {
  const double from_front = w.theta_1 - theta, from_rear = w.theta_2 + theta;
  const double front = 0.5 + w.half_t, rear = 0.5 - w.half_t;
  const double j_t = w.r_over_w * (front * (w.p * (w.sin_1 - s) - w.q_sheared * from_front) +
                                   rear * (w.p * (s + w.sin_2) - w.q_sheared * from_rear));
  const double j_y = w.radius * w.y_over_w * (front * from_front + rear * from_rear);
  const double x = __builtin_sqrt(j_t * j_t + j_y * j_y) * w.inv_k;
  // (1 - e^-x)/x, by its series where the difference would cancel.
  const double series = 1 - x * (0.5 - x * (1.0 / 6 - x * (1.0 / 24 - x / 120)));
  const double large = x > 1e-2 ? x : 1e-2;
  const double mobilised = (x > 1e-2 ? (1 - vm::Exp(-large)) / large : series) * w.inv_k;
  const double strength = limit * mobilised;
  // Per area of the rim, whichever radius it acts at.
  return {-strength * j_t * w.traction, -strength * j_y * w.traction, j_y};
}

GROUSER_CLONES void NormalStress(Work* w) {
  for (int i = 0; i < kN; ++i) {
    const Pressure at = PressureAt(*w, w->node[i]);
    w->sigma[i] = at.sigma;
    w->strength[i] = at.strength;
  }
}

// Shear, side pressure and the force terms of one branch: theta runs from
// `edge` inwards by `span` (signed); `offset` is 0 or kN.
GROUSER_CLONES void BranchTerms(Work* w, double edge, double span, int offset) {
  const double length = span < 0 ? -span : span;
  for (int i = 0; i < kN; ++i) {
    const double theta = edge + span * w->node[i];
    const double s = vm::Sin(theta), c = vm::Cos(theta);
    const Shear shear = ShearAt(*w, theta, s, w->strength[i]);
    const double tau_t = shear.tangential, tau_y = shear.axial, j_y = shear.j_y;
    const double depth0 = w->radius * (c - w->cos_f);
    const double depth = depth0 > 0 ? depth0 : 0;
    const double along = c > 0 ? c : 0;
    const double side =
        (w->side_a * depth + w->side_b) * depth * along * (1 - vm::Exp(-j_y * w->inv_kb));
    const double area = w->weight[i] * length * w->radius;
    const double lateral = area * (w->width * tau_y - side);
    w->term[0][offset + i] = area * w->width * (tau_t * c - w->sigma[i] * s);
    w->term[1][offset + i] = lateral;
    w->term[2][offset + i] = area * w->width * (tau_t * s + w->sigma[i] * c);
    w->term[3][offset + i] = area * w->width * tau_t * w->traction;
    w->term[4][offset + i] =
        (lateral + area * w->width * tau_y * (w->traction - 1)) * w->radius * s;
  }
}

double Total(const double (&term)[2 * kN]) {
  double sum[4] = {0, 0, 0, 0};
  for (int i = 0; i < 2 * kN; i += 4) {
    for (int k = 0; k < 4; ++k) sum[k] += term[i + k];
  }
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

}  // namespace

void BekkerModel::Touch(const Motion& m, double sinkage, BekkerContact* contact) const noexcept {
  const BekkerParameters& a = parameters_;
  const double r = wheel_.radius_m;
  BekkerContact& w = *contact;
  w.theta_f = 2 * std::asin(std::sqrt(0.5 * sinkage / r));
  w.theta_m = w.theta_f * m.peak * m.t;
  w.theta_a = w.theta_f * m.peak * m.t * m.t;
  w.theta_1 = w.theta_f * (a.c3 + (1 - a.c3) * 0.5 * (1 + m.t));
  w.theta_2 = w.theta_f * (a.c3 + (1 - a.c3) * 0.5 * (1 - m.t));
  w.half_t = 0.5 * m.t;
  w.sin_1 = vm::Sin(w.theta_1);
  w.sin_2 = vm::Sin(w.theta_2);
  w.cos_f = 1 - sinkage / r;
  w.p = m.p;
  w.q_sheared = m.q * shear_radius_ratio_;
  w.traction = shear_radius_ratio_;
  w.y_over_w = m.y / m.w;
  w.r_over_w = r / m.w;
  w.radius = r;
  w.inv_k = 1 / a.shear_modulus;
  w.inv_kb = 1 / a.bulldozing_length;
  w.modulus = modulus_;
  w.n = a.n;
  w.inv_multiplier = 1 / m.multiplier;
  w.cohesion = a.cohesion;
  w.inv_cohesion = 1 / Larger(a.cohesion, 1e-30);
  w.friction = friction_;
  w.side_a = 0.5 * a.unit_weight * a.side_passive;
  w.side_b = 2 * a.cohesion * std::sqrt(a.side_passive);
  w.width = wheel_.width_m;
}

RimStress BekkerModel::StressAt(const Canonical& state, double sinkage,
                                double angle) const noexcept {
  RimStress stress;
  StressesAt(state, sinkage, {&angle, 1}, {&stress, 1});
  return stress;
}

void BekkerModel::StressesAt(const Canonical& state, double sinkage, std::span<const double> angle,
                             std::span<RimStress> stress) const noexcept {
  BekkerContact w;
  Touch(MakeMotion(state.forward, state.lateral, state.rim), sinkage, &w);
  for (std::size_t i = 0; i < angle.size(); ++i) {
    const double theta = angle[i];
    stress[i] = {0, 0, 0};
    if (!(theta < w.theta_1 && theta > -w.theta_2)) continue;
    const bool ahead = theta > w.theta_m;
    const double node = ahead ? (w.theta_1 - theta) / (w.theta_1 - w.theta_m)
                              : (theta + w.theta_2) / (w.theta_m + w.theta_2);
    const Pressure at = PressureAt(w, node);
    const Shear shear = ShearAt(w, theta, vm::Sin(theta), at.strength);
    stress[i] = {at.sigma, shear.tangential, shear.axial};
  }
}

BekkerModel::Integrals BekkerModel::Integrate(const Motion& m, double sinkage,
                                              Points points) const noexcept {
  Work w;
  Touch(m, sinkage, &w);
  std::array<double, 5> sum{};
  const int panels = points == Points::kFine ? 32 : 1;
  for (int panel = 0; panel < panels; ++panel) {
    for (int i = 0; i < kN; ++i) {
      w.node[i] = node_[i];
      w.weight[i] = weight_[i];
      if (points == Points::kGraded) {  // fewer than 16: the last one again, weightless
        const int at = i < lanes_.rule.points ? i : lanes_.rule.points - 1;
        w.node[i] = lanes_.rule.node[at];
        w.weight[i] = at == i ? lanes_.rule.weight[at] : 0;
      } else if (points == Points::kFine) {  // crowding towards the edge: x = u^3
        const double u = (panel + node_[i]) / panels;
        w.node[i] = u * u * u;
        w.weight[i] = weight_[i] * 3 * u * u / panels;
      }
    }
    NormalStress(&w);
    BranchTerms(&w, w.theta_1, w.theta_m - w.theta_1, 0);
    BranchTerms(&w, -w.theta_2, w.theta_m + w.theta_2, kN);
    for (int k = 0; k < 5; ++k) sum[k] += Total(w.term[k]);
  }
  return {sum[0] - Blade(m, sinkage, w.theta_f), sum[1], sum[2], wheel_.radius_m * sum[3], sum[4]};
}

double BekkerModel::Blade(const Motion& m, double sinkage, double theta_f) const noexcept {
  const BekkerParameters& a = parameters_;
  const double blade = wheel_.width_m * sinkage *
                       (0.5 * a.unit_weight * a.front_passive * sinkage +
                        2 * a.cohesion * std::sqrt(a.front_passive));
  const double travel = wheel_.radius_m * theta_f * (1 / a.bulldozing_length);
  const double heap = (1 - std::exp(-travel * m.front)) * 0.5 * (1 + m.t) -
                      (1 - std::exp(-travel * m.back)) * 0.5 * (1 - m.t);
  return blade * heap;
}

}  // namespace grouser::surrogate
