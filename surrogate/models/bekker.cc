#include "surrogate/models/bekker.h"

#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>

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
namespace {

namespace vm = vector_math;

constexpr int kN = 16;
constexpr double kStep = 0.05;       // width of the smooth corners
constexpr double kBalanced = 1e-10;  // |ln(F_z/load)| at which z is taken

double Larger(double a, double b) { return a > b ? a : b; }

// max(0, x) with a continuous slope.
double Positive(double x) { return x > 0 ? x * x / (x + kStep) : 0; }

double SmoothMax(double a, double b) {
  return 0.5 * (a + b + std::sqrt((a - b) * (a - b) + kStep * kStep));
}

// Gauss-Legendre nodes and weights on [0, 1], by Newton's method.
struct Quadrature {
  std::array<double, kN> node, weight;

  Quadrature() {
    for (int i = 0; i < kN; ++i) {
      double x = std::cos(std::numbers::pi * (i + 0.75) / (kN + 0.5)), slope = 1;
      for (int k = 0; k < 10; ++k) {  // quadratic: 5 would do
        double p0 = 1, p1 = x;
        for (int j = 2; j <= kN; ++j) {
          const double p2 = ((2 * j - 1) * x * p1 - (j - 1) * p0) / j;
          p0 = p1;
          p1 = p2;
        }
        slope = kN * (x * p1 - p0) / (x * x - 1);
        x -= p1 / slope;
      }
      node[i] = 0.5 * (1 - x);
      weight[i] = 1 / ((1 - x * x) * slope * slope);
    }
  }
};

// All that the point loops read, and where they leave their terms.
struct alignas(64) Work {
  double node[kN], weight[kN];
  double sigma[kN];          // [Pa], common to both branches
  double strength[kN];       // [Pa], of the shear
  double term[5][2 * kN];    // f_x, f_y, f_z, torque/r, m_z per point
  // scalars
  double theta_f, theta_a, theta_1, theta_2, theta_m, half_t, sin_1, sin_2, cos_f;
  double p, q, y_over_w, r_over_w, radius, inv_k, inv_kb;
  double modulus, n, inv_multiplier, cohesion, inv_cohesion, friction, side_a, side_b, width;
};

// sigma_i = k (h/S)^n and the shear strength; h without cancellation as a product of sines.
GROUSER_CLONES void NormalStress(Work* w) {
  for (int i = 0; i < kN; ++i) {
    const double drop = (w->theta_f - w->theta_a) * w->node[i];  // theta_f - phi
    const double h =
        2 * w->radius * vm::Sin(w->theta_f - 0.5 * drop) * vm::Sin(0.5 * drop);
    const double safe = h * w->inv_multiplier > 1e-200 ? h * w->inv_multiplier : 1e-200;
    const double sigma = w->modulus * vm::Exp(w->n * vm::Log(safe));
    w->sigma[i] = sigma;
    w->strength[i] =
        w->cohesion * (1 - vm::Exp(-sigma * w->inv_cohesion)) + sigma * w->friction;
  }
}

// Shear, side pressure and the force terms of one branch: theta runs from
// `edge` inwards by `span` (signed); `offset` is 0 or kN.
GROUSER_CLONES void BranchTerms(Work* w, double edge, double span, int offset) {
  const double length = span < 0 ? -span : span;
  for (int i = 0; i < kN; ++i) {
    const double theta = edge + span * w->node[i];
    const double s = vm::Sin(theta), c = vm::Cos(theta);
    const double from_front = w->theta_1 - theta, from_rear = w->theta_2 + theta;
    const double front = 0.5 + w->half_t, rear = 0.5 - w->half_t;
    const double j_t = w->r_over_w * (front * (w->p * (w->sin_1 - s) - w->q * from_front) +
                                      rear * (w->p * (s + w->sin_2) - w->q * from_rear));
    const double j_y = w->radius * w->y_over_w * (front * from_front + rear * from_rear);
    const double x = __builtin_sqrt(j_t * j_t + j_y * j_y) * w->inv_k;
    // (1 - e^-x)/x, by its series where the difference would cancel.
    const double series = 1 - x * (0.5 - x * (1.0 / 6 - x * (1.0 / 24 - x / 120)));
    const double large = x > 1e-2 ? x : 1e-2;
    const double mobilised = (x > 1e-2 ? (1 - vm::Exp(-large)) / large : series) * w->inv_k;
    const double strength = w->strength[i] * mobilised;
    const double tau_t = -strength * j_t, tau_y = -strength * j_y;
    const double depth0 = w->radius * (c - w->cos_f);
    const double depth = depth0 > 0 ? depth0 : 0;
    const double along = c > 0 ? c : 0;
    const double side = (w->side_a * depth + w->side_b) * depth * along *
                        (1 - vm::Exp(-j_y * w->inv_kb));
    const double area = w->weight[i] * length * w->radius;
    const double lateral = area * (w->width * tau_y - side);
    w->term[0][offset + i] = area * w->width * (tau_t * c - w->sigma[i] * s);
    w->term[1][offset + i] = lateral;
    w->term[2][offset + i] = area * w->width * (tau_t * s + w->sigma[i] * c);
    w->term[3][offset + i] = area * w->width * tau_t;
    w->term[4][offset + i] = lateral * w->radius * s;
  }
}

double Total(const double (&term)[2 * kN]) {
  double sum[4] = {0, 0, 0, 0};
  for (int i = 0; i < 2 * kN; i += 4) {
    for (int k = 0; k < 4; ++k) sum[k] += term[i + k];
  }
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

[[noreturn]] void Refuse(const char* name, double value, const char* expected) {
  std::ostringstream text;
  text << "Bekker parameter " << name << ": " << value << ", expected " << expected;
  throw std::invalid_argument(text.str());
}

}  // namespace

struct BekkerModel::Motion {
  double p, y, q;
  double t;            // 1: entry ahead, -1: entry behind
  double peak;         // theta_m / theta_f where t = 1
  double multiplier;   // S, slip sinkage
  double front, back;  // braking slip of a wheel running forward, backward
  double w;
};

struct BekkerModel::Integrals {
  double f_x, f_y, f_z, torque, m_z;
};

BekkerModel::BekkerModel(const BekkerParameters& parameters, const WheelGeometry& wheel)
    : parameters_(parameters), wheel_(wheel) {
  static_assert(kPoints == kN);
  for (const BekkerField& field : BekkerFields()) {
    const double value = parameters.*field.member;
    if (!(value >= field.low && value <= field.high)) {
      std::ostringstream range;
      range << field.low << " to " << field.high << " " << field.unit;
      Refuse(field.name, value, range.str().c_str());
    }
  }
  if (!(wheel.radius_m > 0 && std::isfinite(wheel.radius_m))) {
    Refuse("wheel radius", wheel.radius_m, "a positive length [m]");
  }
  if (!(wheel.width_m > 0 && std::isfinite(wheel.width_m))) {
    Refuse("wheel width", wheel.width_m, "a positive length [m]");
  }
  modulus_ = parameters.k_c / wheel.width_m + parameters.k_phi;
  if (!(modulus_ > 0)) Refuse("k_c/b + k_phi", modulus_, "a positive modulus");
  friction_ = std::tan(parameters.friction_angle);
  static const Quadrature quadrature;  // once: fits make many models
  node_ = quadrature.node;
  weight_ = quadrature.weight;
}

BekkerModel::Motion BekkerModel::MakeMotion(double p, double y, double q) const noexcept {
  const BekkerParameters& a = parameters_;
  Motion m{};
  m.p = p;
  m.y = y;
  m.q = q;
  const double x = (p + a.turn_spin * q) / a.turn_speed;
  m.t = x / std::sqrt(1 + x * x);
  const double ahead = 0.5 * (1 + m.t), behind = 0.5 * (1 - m.t);
  const double more = Positive(q - p), less = Positive(p - q);
  const double drive = more * ahead + less * behind;
  m.front = less;
  m.back = more;
  const double brake = less * ahead + more * behind;
  m.multiplier = std::exp(a.sinkage_drive * drive + a.sinkage_brake * brake +
                          a.sinkage_lateral * y * y);
  // Smoothly kept within (0.02, 0.9).
  const double raised = SmoothMax(a.c1 + a.c2 * (q - p) * m.t, 0.02);
  m.peak = -SmoothMax(-raised, -0.9);
  m.w = SmoothMax(std::fabs(p), std::fabs(q));
  return m;
}

BekkerModel::Integrals BekkerModel::Integrate(const Motion& m, double sinkage) const noexcept {
  const BekkerParameters& a = parameters_;
  const double r = wheel_.radius_m;
  Work w;
  for (int i = 0; i < kN; ++i) {
    w.node[i] = node_[i];
    w.weight[i] = weight_[i];
  }
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
  w.q = m.q;
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
  NormalStress(&w);
  BranchTerms(&w, w.theta_1, w.theta_m - w.theta_1, 0);
  BranchTerms(&w, -w.theta_2, w.theta_m + w.theta_2, kN);

  const double blade =
      wheel_.width_m * sinkage *
      (0.5 * a.unit_weight * a.front_passive * sinkage +
       2 * a.cohesion * std::sqrt(a.front_passive));
  const double travel = r * w.theta_f * w.inv_kb;
  const double heap = (1 - std::exp(-travel * m.front)) * 0.5 * (1 + m.t) -
                      (1 - std::exp(-travel * m.back)) * 0.5 * (1 - m.t);
  return {Total(w.term[0]) - blade * heap, Total(w.term[1]), Total(w.term[2]),
          r * Total(w.term[3]), Total(w.term[4])};
}

double BekkerModel::GuessSinkage(const Motion& m, double load) const noexcept {
  // F_z of a uniform profile: c b k (z/S)^n sqrt(2 r z), c about 0.6.
  const double n = parameters_.n, r = wheel_.radius_m;
  const double ease = std::pow(m.multiplier, n);
  const double scale = 0.6 * wheel_.width_m * modulus_ * std::sqrt(2 * r) / ease;
  const double z = std::pow(load / scale, 1 / (n + 0.5));
  return z < 1e-12 * r ? 1e-12 * r : z > max_sinkage() ? max_sinkage() : z;
}

BekkerModel::Answer BekkerModel::Balance(const Motion& m, double load) const noexcept {
  const double z_max = max_sinkage();
  double low = 0, high = 0, f_low = 0, f_high = 0;  // bracket; 0: not yet known
  double z = GuessSinkage(m, load);
  double last_u = 0, last_f = 0, slope = parameters_.n + 0.5;
  Integrals sums{};
  bool overload = false;
  int count = 0;
  while (true) {
    sums = Integrate(m, z);
    ++count;
    const double f = std::log(Larger(sums.f_z / load, 1e-12));
    if (std::fabs(f) <= kBalanced) break;
    if (count >= 100) {
      overload = std::fabs(f) > 1e-6;  // only beyond any real load
      break;
    }
    (f < 0 ? low : high) = z;
    (f < 0 ? f_low : f_high) = f;
    if (low >= z_max) {
      overload = true;
      break;
    }
    if (high > 0 && high - low <= 1e-15 * high) break;
    const double u = std::log(z);
    if (count > 1 && u != last_u) {
      const double secant = (f - last_f) / (u - last_u);
      if (secant > 0.1) slope = secant;
    }
    last_u = u;
    last_f = f;
    // At most a factor 1.6 a step upwards: the first crossing is the balance.
    const double step = -f / slope;
    double next = z * std::exp(step > 0.47 ? 0.47 : step < -30 ? -30 : step);
    if (high == 0) {
      next = next < z_max ? next : z_max;
    } else if (low == 0) {
      next = next < high ? next : 0.5 * high;
    } else if (next <= low || next >= high || count > 8) {
      // False position and bisection in turn: the bracket shrinks whatever F_z does.
      const double share = count % 2 == 0 ? f_low / (f_low - f_high) : 0.5;
      next = low * std::exp(share * std::log(high / low));
    }
    z = next;
  }
  return {{sums.f_x, sums.f_y, sums.f_z, sums.torque, sums.m_z, z}, overload, count};
}

BekkerModel::Answer BekkerModel::SolveCanonical(const Canonical& state,
                                                double load) const noexcept {
  return Balance(MakeMotion(state.forward, state.lateral, state.rim), load);
}

BekkerModel::Answer BekkerModel::AtSinkage(const Canonical& state,
                                           double sinkage) const noexcept {
  const Integrals i = Integrate(MakeMotion(state.forward, state.lateral, state.rim), sinkage);
  return {{i.f_x, i.f_y, i.f_z, i.torque, i.m_z, sinkage}, false, 1};
}

BekkerModel::Answer BekkerModel::Solve(double v_x, double v_y, double rim_speed,
                                       double load) const noexcept {
  const Canonical state = ToCanonical(v_x, v_y, rim_speed);
  Answer answer = SolveCanonical(state, load);
  ApplyMirrors(state, &answer.value);
  return answer;
}

BekkerModel::Answer BekkerModel::SolveStatic(double load) const noexcept {
  Answer answer = Balance(MakeMotion(0, 0, 0), load);
  for (const Output o : {kFx, kFy, kTorque, kMz}) answer.value[o] = 0;
  return answer;
}

}  // namespace grouser::surrogate
