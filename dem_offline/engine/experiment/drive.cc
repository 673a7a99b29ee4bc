#include "dem_offline/engine/experiment/drive.h"

#include <cmath>
#include <utility>

namespace grouser::dem::experiment {
namespace {

constexpr double kFeltTime = 1.0 / 15;    // [sqrt(d/g)] over which forces at ends are smoothed
constexpr double kDamperTime = 1.0 / 3;   // [sqrt(d/g)] of the damper of a held axis
constexpr std::int64_t kLookSteps = 200;  // between looks at whether the grains are at rest

Vec3d ForceOf(const Wrench& w) { return {w.fx, w.fy, w.fz}; }
bool Any(const Vec3d& v) { return DotD(v, v) > 0; }

}  // namespace

Drive::Drive(const BodySpec& spec, int body, const BuiltBody& built, std::vector<double> most_s,
             const FreeMass& mass, const Surroundings& around)
    : spec_(spec),
      body_(body),
      centre_(MatrixOf(built.turn).Back(built.centre_m)),
      axle_(MatrixOf(built.turn).Back({0, 1, 0})),
      most_(std::move(most_s)),
      mass_(mass),
      around_(around) {}

double Drive::Share() const {
  const MotionStep& s = spec_.motion[at_];
  const double t = (static_cast<double>(steps_) + 0.5) * around_.dt_s;
  return t < s.ramp_s ? 0.5 - 0.5 * std::cos(M_PI * t / s.ramp_s) : 1.0;
}

Vec3d Drive::Swing(double t) const {
  const MotionStep& s = spec_.motion[at_];
  return Scale(std::sin(2 * M_PI * s.frequency_hz * t), s.amplitude_m);
}

void Drive::Enter(World& world) {
  entered_ = true;
  steps_ = 0;
  gone_m_ = turned_step_ = felt_n_ = 0;
  const MotionStep& s = spec_.motion[at_];
  Body& b = world.body(body_);
  if (s.free) {
    world.Release(body_);
  } else {
    b.motion = BodyMotion::kPrescribed;
  }
  // A held axis goes on from one step to the next; a new one starts from rest.
  const bool same = at_ > 0 && spec_.motion[at_ - 1].hold && s.hold &&
                    spec_.motion[at_ - 1].direction == s.direction;
  if (!same) held_m_per_s_ = 0;
  const Mat3d turn = MatrixOf(b.orientation);
  const Vec3d origin =
      Sub(b.velocity_m_per_s, CrossD(b.spin_rad_per_s, turn * centre_));  // its velocity
  freedoms_.Enter(at_ > 0 ? &spec_.motion[at_ - 1] : nullptr, s, origin,
                  DotD(b.spin_rad_per_s, turn * axle_));
}

void Drive::Before(World& world) {
  Body& b = world.body(body_);
  if (done()) {
    if (b.motion == BodyMotion::kFree) return;
    b.velocity_m_per_s = b.spin_rad_per_s = {0, 0, 0};
    return;
  }
  if (!entered_) Enter(world);
  const MotionStep& s = spec_.motion[at_];
  if (s.free) return;
  const double dt = around_.dt_s, t = static_cast<double>(steps_) * dt;
  double share = Share();
  const double speed = Norm(s.velocity_m_per_s), rate = Norm(s.spin_rad_per_s);
  // The last part of a way is no longer than what is left of it.
  if (speed > 0) share = std::min(share, (s.distance_m - gone_m_) / (speed * dt));
  if (rate > 0) share = std::min(share, (s.angle_rad - turned_step_) / (rate * dt));
  speed_now_ = share * speed;
  spin_now_ = share * rate;
  Vec3d v = Scale(share, s.velocity_m_per_s);
  if (Any(s.amplitude_m)) v = Add(v, Scale(1 / dt, Sub(Swing(t + dt), Swing(t))));
  if (s.hold) {
    const double mass =
        s.hold_mass_kg > 0 ? s.hold_mass_kg : s.hold_force_n / around_.gravity_m_per_s2;
    const bool still = !Any(s.velocity_m_per_s) && !Any(s.spin_rad_per_s) && !Any(s.amplitude_m);
    const double rule = still ? kDamperTime * around_.unit_s : 0;
    const double damper = s.hold_damper_s >= 0 ? s.hold_damper_s : rule;
    const double push = s.hold_force_n + DotD(ForceOf(world.wrench(body_)), s.direction);
    held_m_per_s_ += dt * push / mass;
    if (damper > 0) held_m_per_s_ /= 1 + dt / damper;
    v = Add(Sub(v, Scale(DotD(v, s.direction), s.direction)), Scale(held_m_per_s_, s.direction));
  }
  const Vec3d axle = MatrixOf(b.orientation) * axle_;
  Vec3d spin = Scale(share, s.about_axle ? Scale(s.spin_rad_per_s[1], axle) : s.spin_rad_per_s);
  if (HasFreedom(s)) {
    const Wrench& w = world.wrench(body_);
    freedoms_.Advance(s, mass_, ForceOf(w), {w.tx, w.ty, w.tz}, axle, around_.gravity_m_per_s2, dt,
                      &v, &spin);
  }
  // The velocity is that of the file's origin; the Body's is its centre of mass.
  if (Any(centre_)) v = Add(v, CrossD(spin, MatrixOf(b.orientation) * centre_));
  b.velocity_m_per_s = v;
  b.spin_rad_per_s = spin;
}

bool Drive::Ended(const World& world) {
  const MotionStep& s = spec_.motion[at_];
  const double time = static_cast<double>(steps_) * around_.dt_s;
  constexpr double kRounding = 1 + 1e-12;
  if (time * kRounding >= s.for_s || gone_m_ * kRounding >= s.distance_m ||
      turned_step_ * kRounding >= s.angle_rad) {
    return true;
  }
  const Vec3d force = ForceOf(world.wrench(body_));
  if (s.touch && Any(force)) return true;
  if (std::isfinite(s.force_n)) {
    const Vec3d along =
        s.hold ? s.direction
               : Scale(1 / std::max(Norm(s.velocity_m_per_s), 1e-300), s.velocity_m_per_s);
    felt_n_ += std::min(1.0, around_.dt_s / (kFeltTime * around_.unit_s)) *
               (-DotD(force, along) - felt_n_);
    if (felt_n_ >= s.force_n) return true;
  }
  if (!s.until_done.empty() && around_.done(s.until_done)) return true;
  if (!(s.rest > 0) || steps_ % kLookSteps != 0) return false;
  // A body that has not fallen yet leaves the grains at rest.
  const double weight_way = std::pow(around_.gravity_m_per_s2 * around_.unit_s, 2);  // g d
  const bool falls = HasFreedom(s) && !(0.5 * freedoms_.Speed2(s) < s.rest * weight_way);
  return !falls && around_.restlessness() < s.rest;
}

bool Drive::After(const World& world) {
  if (done()) return true;
  const MotionStep& s = spec_.motion[at_];
  ++steps_;
  const double dt = around_.dt_s;
  if (HasFreedom(s) && !Any(s.velocity_m_per_s) && !s.hold) {
    gone_m_ = freedoms_.Way(s);
  } else {
    gone_m_ += dt * (Any(s.velocity_m_per_s) ? speed_now_ : s.hold ? held_m_per_s_ : 0.0);
  }
  turned_step_ = s.free_spin ? std::abs(freedoms_.turn_rad()) : turned_step_ + dt * spin_now_;
  if (Ended(world)) {
    ++at_;
    entered_ = false;
    return true;
  }
  const double most = most_[at_];
  if (static_cast<double>(steps_) * dt < most + dt) return true;
  reason_ = "body '" + spec_.name + "', step " + std::to_string(at_) + " (" + s.verb +
            "): no end of it within " + Short(most) + " s";
  return false;
}

}  // namespace grouser::dem::experiment
