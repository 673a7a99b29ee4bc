#include "rover.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

namespace {

constexpr double kForwardOfMiddle = 0.05;  // centre of gravity, over half the length

// Largest slope of -force/load over hub speed/rim speed that the model shows
// along (axis 0: f_x by v_x) or across (axis 1: f_y by v_y), for wheels that
// drive or brake a little.
double Stiffness(const grouser::Model& model, double load, int axis) {
  const double speed = model.domain().speed_m_per_s, change = 0.02;
  const grouser::Output force = axis == 0 ? grouser::kFx : grouser::kFy;
  double steepest = 0.2;
  for (const double hub : {0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2}) {
    double ends[2] = {};
    for (const int side : {0, 1}) {
      const double by = side == 0 ? -change : change;
      const double v_x = axis == 0 ? hub + by : hub, v_y = axis == 0 ? 0 : by;
      ends[side] =
          model.Evaluate({speed * v_x, speed * v_y, speed, load}).output[force].value / load;
    }
    const double slope = (ends[0] - ends[1]) / (2 * change);
    if (std::isfinite(slope)) steepest = std::max(steepest, slope);
  }
  return steepest;
}

}  // namespace

Rover Rover::For(const grouser::Model& model, int wheels) {
  if (wheels != 4 && wheels != 6) throw std::invalid_argument("wheels: expected 4 or 6");
  const grouser::Domain& domain = model.domain();
  const double load = 1.4 * domain.load_min_n;  // light: a smooth wheel in loose sand hardly pulls
  Rover rover;
  rover.wheels = wheels;
  rover.radius = model.radius_m();
  rover.mass = wheels * load / kGravity;
  const int axles = wheels / 2;
  const double half_length = 1.6 * rover.radius * axles, half_track = 2.9 * rover.radius;
  rover.track = 2 * half_track;
  rover.inertia = rover.mass * (half_length * half_length + half_track * half_track) / 3;  // plate
  double mean_square = 0;
  for (int i = 0; i < wheels; ++i) {
    const int axle = i / 2;  // from the front
    rover.x[i] = half_length * (1 - 2.0 * axle / (axles - 1));
    rover.y[i] = i % 2 == 0 ? half_track : -half_track;
    mean_square += rover.x[i] * rover.x[i] / wheels;
  }
  for (int i = 0; i < wheels; ++i) {
    rover.load[i] = load * (1 + rover.x[i] * kForwardOfMiddle * half_length / mean_square);
  }
  rover.stiffness_x = Stiffness(model, load, 0);
  rover.stiffness_y = Stiffness(model, load, 1);
  return rover;
}

WheelBatch::WheelBatch(const Rover& rover, const grouser::Model& model, std::size_t most_bodies)
    : rover_(rover), model_(model) {
  const std::size_t states = most_bodies * static_cast<std::size_t>(rover.wheels);
  for (std::vector<double>* array : {&v_x_, &v_y_, &rim_, &load_, &f_x_, &f_y_, &m_z_, &torque_,
                                     &pull_low_, &pull_high_, &sinkage_high_}) {
    array->resize(states);
  }
  flags_.resize(states);
}

void WheelBatch::FillStates(std::span<const Control> controls, std::span<const Body> bodies) {
  const std::size_t n = bodies.size();
  for (int i = 0; i < rover_.wheels; ++i) {
    const double x = rover_.x[i], y = rover_.y[i];
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t at = static_cast<std::size_t>(i) * n + k;
      v_x_[at] = bodies[k].u - bodies[k].r * y;
      v_y_[at] = bodies[k].v + bodies[k].r * x;
      rim_[at] = y > 0 ? controls[k].left : controls[k].right;
      load_[at] = rover_.load[i];
    }
  }
}

void WheelBatch::Ask(std::size_t states) {
  const auto in = [states](const std::vector<double>& v) {
    return std::span<const double>(v).first(states);
  };
  const auto to = [states](std::vector<double>& v) { return std::span(v).first(states); };
  grouser::Answers out;  // spans that stay empty cost nothing
  out.output[grouser::kFx].value = to(f_x_);
  out.output[grouser::kFx].low = to(pull_low_);
  out.output[grouser::kFx].high = to(pull_high_);
  out.output[grouser::kFy].value = to(f_y_);
  out.output[grouser::kMz].value = to(m_z_);
  out.output[grouser::kTorque].value = to(torque_);
  out.output[grouser::kSinkage].high = to(sinkage_high_);
  out.flags = std::span(flags_).first(states);
  const grouser::States asked = {in(v_x_), in(v_y_), in(rim_), in(load_)};
  const auto start = std::chrono::steady_clock::now();
  if (!model_.Evaluate(asked, out)) {
    throw std::logic_error("Evaluate: " + grouser::Model::SizeProblem(asked, out));
  }
  model_seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  states_ += static_cast<std::int64_t>(states);
}

void WheelBatch::Step(double dt, std::span<const Control> controls, std::span<Body> bodies,
                      std::span<StepReport> reports) {
  const std::size_t n = bodies.size();
  FillStates(controls, bodies);
  Ask(n * static_cast<std::size_t>(rover_.wheels));
  for (std::size_t k = 0; k < n; ++k) {
    Body& body = bodies[k];
    const double hub = std::hypot(body.u, body.v);
    StepReport report;
    double f_x = 0, f_y = 0, moment = 0, damping_x = 0, damping_y = 0, damping_yaw = 0;
    for (int i = 0; i < rover_.wheels; ++i) {
      const std::size_t at = static_cast<std::size_t>(i) * n + k;
      const double x = rover_.x[i], y = rover_.y[i];
      report.failed |= (flags_[at] & (grouser::kInvalid | grouser::kNoEquilibrium)) != 0;
      f_x += f_x_[at];
      f_y += f_y_[at];
      moment += x * f_y_[at] - y * f_x_[at] + m_z_[at];
      const double speed = std::max({std::fabs(rim_[at]), hub, 1e-3});
      const double along = rover_.stiffness_x * load_[at] / speed;
      const double across = rover_.stiffness_y * load_[at] / speed;
      damping_x += along;
      damping_y += across;
      damping_yaw += along * y * y + across * x * x;
      report.power_w += std::max(0.0, torque_[at] * rim_[at] / rover_.radius);
      report.sinkage_high = std::max(report.sinkage_high, sinkage_high_[at] / rover_.radius);
      report.pull_doubt += (pull_high_[at] - pull_low_[at]) / (2 * load_[at] * rover_.wheels);
    }
    reports[k] = report;
    if (report.failed) continue;  // it stays where it is; the planner turns it down
    const double m = rover_.mass, u = body.u, v = body.v, r = body.r;
    body.u += (f_x + m * r * v) / (m / dt + damping_x);
    body.v += (f_y - m * r * u) / (m / dt + damping_y);
    body.r += moment / (rover_.inertia / dt + damping_yaw);
    const double middle = body.yaw + 0.5 * dt * body.r;
    body.x += dt * (body.u * std::cos(middle) - body.v * std::sin(middle));
    body.y += dt * (body.u * std::sin(middle) + body.v * std::cos(middle));
    body.yaw += dt * body.r;
  }
}
