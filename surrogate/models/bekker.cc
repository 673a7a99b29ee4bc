#include "surrogate/models/bekker.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "surrogate/models/bekker_batch.h"
#include "surrogate/models/bekker_motion.h"
#include "surrogate/models/quadrature.h"

namespace grouser::surrogate {
namespace {

constexpr double kStep = 0.05;       // width of the smooth corners
constexpr double kBalanced = 1e-10;  // |ln(F_z/load)| at which z is taken

double Larger(double a, double b) { return a > b ? a : b; }

// max(0, x) with a continuous slope.
double Positive(double x) { return x > 0 ? x * x / (x + kStep) : 0; }

double SmoothMax(double a, double b) {
  return 0.5 * (a + b + std::sqrt((a - b) * (a - b) + kStep * kStep));
}

[[noreturn]] void Refuse(const char* name, double value, const char* expected) {
  std::ostringstream text;
  text << "Bekker parameter " << name << ": " << value << ", expected " << expected;
  throw std::invalid_argument(text.str());
}

// k of sigma = k (h/S)^n [N/m^(n+2)], in either form.
double Modulus(const BekkerParameters& p, double width) {
  if (p.pressure_form == kBekkerForm) {
    const double modulus = p.k_c / width + p.k_phi;
    if (!(modulus > 0)) Refuse("k_c/b + k_phi", modulus, "a positive modulus");
    return modulus;
  }
  if (p.pressure_form != kReeceForm) {
    Refuse("pressure_form", p.pressure_form, "0 (Bekker) or 1 (Reece)");
  }
  const double pressure = p.cohesion * p.reece_k_c + p.unit_weight * width * p.reece_k_phi;
  if (!(pressure > 0)) Refuse("c k_c' + gamma b k_phi'", pressure, "a positive pressure");
  return pressure / std::pow(width, p.n);
}

}  // namespace

BekkerModel::BekkerModel(const BekkerParameters& parameters, const WheelGeometry& wheel)
    : parameters_(parameters), wheel_(wheel) {
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
  modulus_ = Modulus(parameters, wheel.width_m);
  friction_ = std::tan(parameters.friction_angle);
  shear_radius_ratio_ = 1 + parameters.grouser_share * parameters.grouser_height / wheel.radius_m;
  static const GaussRule<kPoints> rule = GaussLegendre<kPoints>();  // fits make many models
  node_ = rule.node;
  weight_ = rule.weight;
  lanes_ = MakeLaneModel(*this);
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
  m.multiplier =
      std::exp(a.sinkage_drive * drive + a.sinkage_brake * brake + a.sinkage_lateral * y * y);
  // Smoothly kept within (0.02, 0.9).
  const double raised = SmoothMax(a.c1 + a.c2 * (q - p) * m.t, 0.02);
  m.peak = -SmoothMax(-raised, -0.9);
  m.w = SmoothMax(std::fabs(p), std::fabs(q));
  return m;
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
    sums = Integrate(m, z, Points::kPlain);
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
    // Where F_z hardly grows, longer and longer steps bracket it.
    const bool open = high == 0 || low == 0;
    const double step = -f / slope * (open && count > 8 ? std::ldexp(1, count - 8) : 1);
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

BekkerModel::Answer BekkerModel::AtSinkage(const Canonical& state, double sinkage,
                                           Points points) const noexcept {
  const Integrals i =
      Integrate(MakeMotion(state.forward, state.lateral, state.rim), sinkage, points);
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
