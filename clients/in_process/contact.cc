#include "clients/in_process/grouser/contact.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/in_process/contact_load.h"
#include "clients/in_process/parts.h"

namespace grouser {
namespace {

using Vector = std::array<double, 3>;

double Dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector Cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
bool Finite(const Vector& a) {
  return std::isfinite(a[0]) && std::isfinite(a[1]) && std::isfinite(a[2]);
}
// False: too short to have a direction, or so long that its square overflows.
bool Normalise(Vector* a) {
  const double length = std::sqrt(Dot(*a, *a));
  if (!(length > 0 && std::isfinite(length))) return false;
  for (double& x : *a) x /= length;
  return true;
}

constexpr double kLying = 0.06;   // sine of axle and normal
constexpr double kSteady = 1e-6;  // 1 - m of a motion that counts as steady

// A wheel in its contact frame.
struct Frame {
  Vector x{}, y{}, n{}, axle{};
  double height = 0, sinkage = 0, sinking = 0;  // of the centre; z, dz/dt
  double v_x = 0, v_y = 0, rim = 0;
};

enum class Place { kBad, kAway, kLyingFlat, kTouching };

Place Locate(const WheelMotion& w, const ContactState& u, double radius, Frame* f) {
  if (!Finite({u.v_x, u.v_y, u.rim}) || !Finite(w.centre) || !Finite(w.axle) ||
      !Finite(w.velocity) || !Finite(w.angular_velocity) || !Finite(w.ground_point) ||
      !Finite(w.ground_normal) || !std::isfinite(w.time_step) || w.time_step < 0) {
    return Place::kBad;
  }
  f->n = w.ground_normal;
  f->axle = w.axle;
  if (!Normalise(&f->n) || !Normalise(&f->axle)) return Place::kBad;
  const Vector from = {w.centre[0] - w.ground_point[0], w.centre[1] - w.ground_point[1],
                       w.centre[2] - w.ground_point[2]};
  f->height = Dot(f->n, from);
  f->x = Cross(f->axle, f->n);
  const double upright = std::sqrt(Dot(f->x, f->x));
  f->sinkage = radius * upright - f->height;
  f->sinking = -Dot(f->n, w.velocity);
  if (f->sinkage <= 0) return Place::kAway;
  if (upright < kLying) return Place::kLyingFlat;
  for (double& x : f->x) x /= upright;
  f->y = Cross(f->n, f->x);
  f->v_x = Dot(f->x, w.velocity);
  f->v_y = Dot(f->y, w.velocity);
  f->rim = radius * Dot(f->axle, w.angular_velocity);
  return Place::kTouching;
}

double Speed(double v_x, double v_y, double rim) {
  return std::max(std::fabs(rim), std::hypot(v_x, v_y));
}

// One step of the direction of motion.
void Relax(const Frame& f, double length, double dt, ContactState* u) {
  const double speed = Speed(f.v_x, f.v_y, f.rim);
  if (speed == 0) {
    if (length == 0) *u = {};
    return;
  }
  const double share = length == 0 ? 1 : -std::expm1(-speed * dt / length);
  u->v_x += share * (f.v_x / speed - u->v_x);
  u->v_y += share * (f.v_y / speed - u->v_y);
  u->rim += share * (f.rim / speed - u->rim);
}

// What the model is asked: the direction, and `damping_time` of its change, at the wheel's speed.
RelaxedMotion AskedOf(const Frame& f, const ContactState& state, double length,
                      double damping_time) {
  ContactState u = state;
  const double speed = Speed(f.v_x, f.v_y, f.rim);
  if (speed > 0 && length > 0) {
    const double share = std::min(1.0, damping_time * speed / length);
    u.v_x += share * (f.v_x / speed - u.v_x);
    u.v_y += share * (f.v_y / speed - u.v_y);
    u.rim += share * (f.rim / speed - u.rim);
  }
  const double moving = Speed(u.v_x, u.v_y, u.rim);
  if (moving == 0) return {0, 0, 0, 0};
  const double scale = std::max(speed, 1e-9) / moving;  // of a wheel that is held: any speed
  return {scale * u.v_x, scale * u.v_y, scale * u.rim, moving > 1 - kSteady ? 1 : moving};
}

// kappa: rise of pull over load with slip, of a wheel that rolls straight.
double SlipStiffness(const Model& model) {
  const Domain& d = model.domain();
  const double load = std::sqrt(d.load_min_n * d.load_max_n);
  const double v = d.speed_m_per_s > 0 ? d.speed_m_per_s : 0.1;
  const Answer less =
      model.Evaluate(State{.v_x = v, .v_y = 0, .rim_speed = 0.95 * v, .load = load});
  const Answer more =
      model.Evaluate(State{.v_x = v, .v_y = 0, .rim_speed = 1.05 * v, .load = load});
  const double rise = more.output[kFx].value - less.output[kFx].value;
  return std::max(0.1, rise / (load * (more.slip - less.slip)));
}

void Require(bool good, const char* name, double got, const char* expected) {
  if (good) return;
  throw std::invalid_argument(std::string(name) + ": got " + std::to_string(got) + ", expected " +
                              expected);
}

}  // namespace

struct WheelContact::Parts {
  const Model* model;
  ContactOptions options;
  double length, damping_time;  // sigma, tau
  LoadSearch search;
  // By wheel that touches the ground.
  std::vector<std::size_t> wheel;
  std::vector<Frame> frame;
  std::vector<RelaxedMotion> motion;
  std::vector<double> sinkage, static_load, load, v_x, v_y, rim;
  std::array<std::vector<double>, kOutputs> value;
  std::vector<std::uint32_t> flags;

  void Find(std::span<const WheelMotion> wheels, std::span<ContactState> states,
            std::span<WheelForce> out);
  void Ask();
  void Write(std::size_t i, WheelForce* to) const;
};

WheelContact::WheelContact(const Model& model, const ContactOptions& options) {
  Require(options.tyre_stiffness > 0, "tyre_stiffness", options.tyre_stiffness, "above 0 N/m");
  Require(options.damping_ratio >= 0 && std::isfinite(options.damping_ratio), "damping_ratio",
          options.damping_ratio, "0 or more");
  Require(options.relaxation_over_radius >= 0 && std::isfinite(options.relaxation_over_radius),
          "relaxation_over_radius", options.relaxation_over_radius, "0 or more");
  Require(options.shear_damping_ratio >= 0 && std::isfinite(options.shear_damping_ratio),
          "shear_damping_ratio", options.shear_damping_ratio, "0 or more");
  const double load = model.domain().load_max_n;
  const bool sinks = model.Evaluate(State{.v_x = 1, .v_y = 0, .rim_speed = 1, .load = load})
                         .output[kSinkage]
                         .value > 0;
  Require(sinks || std::isfinite(options.tyre_stiffness), "tyre_stiffness", options.tyre_stiffness,
          ("a finite one: on " + model.soil() + " the wheel does not sink").c_str());
  const double length = options.relaxation_over_radius * model.radius_m();
  const double damping_time = 2 * options.shear_damping_ratio *
                              std::sqrt(length / (SlipStiffness(model) * model.gravity_m_per_s2()));
  parts_ = std::unique_ptr<Parts>(new Parts{&model,
                                            options,
                                            length,
                                            damping_time,
                                            LoadSearch(model, options.tyre_stiffness),
                                            {},
                                            {},
                                            {},
                                            {},
                                            {},
                                            {},
                                            {},
                                            {},
                                            {},
                                            {},
                                            {}});
}
WheelContact::WheelContact(WheelContact&& other) noexcept = default;
WheelContact& WheelContact::operator=(WheelContact&& other) noexcept = default;
WheelContact::~WheelContact() = default;

const Model& WheelContact::model() const noexcept { return *parts_->model; }
const ContactOptions& WheelContact::options() const noexcept { return parts_->options; }

// Gathers the wheels on the ground; the others are answered.
void WheelContact::Parts::Find(std::span<const WheelMotion> wheels, std::span<ContactState> states,
                               std::span<WheelForce> out) {
  wheel.clear();
  frame.clear();
  motion.clear();
  sinkage.clear();
  const double radius = model->radius_m();
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    out[i] = {};
    Frame f;
    const Place place = Locate(wheels[i], states[i], radius, &f);
    if (place == Place::kBad) {
      out[i].force = out[i].moment = {kNaN, kNaN, kNaN};
      out[i].load = out[i].static_load = out[i].sinkage = kNaN;
      out[i].flags = kInvalid;
      continue;
    }
    out[i].sinkage = f.sinkage;
    if (place != Place::kTouching) {
      states[i] = {};
      out[i].flags = place == Place::kLyingFlat ? kExtrapolated : kAirborne;
      continue;
    }
    Relax(f, length, wheels[i].time_step, &states[i]);
    wheel.push_back(i);
    frame.push_back(f);
    motion.push_back(AskedOf(f, states[i], length, damping_time));
    sinkage.push_back(f.sinkage);
  }
}

void WheelContact::Parts::Ask() {
  const std::size_t n = wheel.size();
  static_load.resize(n);
  load.resize(n);
  search.Solve(motion, sinkage, static_load);
  v_x.resize(n);
  v_y.resize(n);
  rim.resize(n);
  flags.resize(n);
  Answers answers;
  answers.flags = flags;
  for (std::size_t o = 0; o < kOutputs; ++o) {
    value[o].resize(n);
    answers.output[o].value = value[o];
  }
  const double zeta = options.damping_ratio, gravity = model->gravity_m_per_s2();
  for (std::size_t i = 0; i < n; ++i) {
    const double damped = 1 + 2 * zeta * frame[i].sinking / std::sqrt(gravity * sinkage[i]);
    load[i] = static_load[i] * std::max(0.0, damped);
    v_x[i] = motion[i].v_x;
    v_y[i] = motion[i].v_y;
    rim[i] = motion[i].rim_speed;
  }
  (void)model->Evaluate({v_x, v_y, rim, load}, answers);  // sizes are right
}

void WheelContact::Parts::Write(std::size_t i, WheelForce* to) const {
  const Frame& f = frame[i];
  const double share = motion[i].moving;
  to->load = load[i];
  to->static_load = static_load[i];
  to->v_x = v_x[i];
  to->v_y = v_y[i];
  to->rim_speed = rim[i];
  to->mobilised = share;
  to->f_x = share * value[kFx][i];
  to->f_y = share * value[kFy][i];
  to->torque = share * value[kTorque][i];
  to->m_z = share * value[kMz][i];
  to->flags = flags[i];
  for (std::size_t k = 0; k < 3; ++k) {
    to->force[k] = to->f_x * f.x[k] + to->f_y * f.y[k] + to->load * f.n[k];
    to->moment[k] = f.height * to->f_y * f.x[k] - to->torque * f.axle[k] + to->m_z * f.n[k];
  }
}

bool WheelContact::Evaluate(std::span<const WheelMotion> wheels, std::span<ContactState> states,
                            std::span<WheelForce> out) {
  if (parts_ == nullptr || states.size() != wheels.size() || out.size() != wheels.size()) {
    return false;
  }
  parts_->Find(wheels, states, out);
  parts_->Ask();
  for (std::size_t i = 0; i < parts_->wheel.size(); ++i) {
    parts_->Write(i, &out[parts_->wheel[i]]);
  }
  return true;
}

WheelForce WheelContact::Evaluate(const WheelMotion& wheel, ContactState* state) {
  WheelForce out;
  (void)Evaluate({&wheel, 1}, {state, 1}, {&out, 1});
  return out;
}

}  // namespace grouser
