#include "surrogate/vehicle/mechanics.h"

#include <algorithm>
#include <cmath>

namespace grouser::vehicle {
namespace {

constexpr double kCreep = 1e-3;     // [m/s] at which a vehicle at rest is solved
constexpr double kSteepest = 1e-3;  // cosine of a slope that nothing stands on

int Number(std::size_t i) { return static_cast<int>(i); }

}  // namespace

Mechanics::Mechanics(const Vehicle& vehicle)
    : vehicle_(vehicle), support_(vehicle), steered_(vehicle.steered()) {
  for (std::size_t i = 0; i < wheels(); ++i) {
    radius_[i] = vehicle.wheel_types[vehicle.wheels[i].type].radius_m;
  }
  double mean_x = 0, mean_y = 0;
  for (std::size_t i = 0; i < wheels(); ++i) {
    mean_x += vehicle.wheels[i].x_m / static_cast<double>(wheels());
    mean_y += vehicle.wheels[i].y_m / static_cast<double>(wheels());
    mean_radius_ += radius(i) / static_cast<double>(wheels());
  }
  for (const Wheel& w : vehicle.wheels) {
    length_ = std::max(length_, std::hypot(w.x_m - mean_x, w.y_m - mean_y));
  }
  middle_x_ = vehicle.steered() ? vehicle.steering.centre_x_m : mean_x;
  weight_ = vehicle.mass_kg * vehicle.gravity_m_per_s2;
  per_ = {1 / weight_, 1 / weight_, 1 / length_ / weight_, 1 / mean_radius_ / weight_};
  for (std::size_t i = wheels(); i-- > 0;) {
    if (const int drive = vehicle.wheels[i].drive; drive >= 0) {
      first_[static_cast<std::size_t>(drive)] = i;
    }
  }
  for (Layout& layout : layouts_) {
    layout.drive.fill(-1);
    layout.rim.fill(-1);
    for (std::size_t i = 0; i < wheels(); ++i) {
      const int drive = vehicle.wheels[i].drive;
      const bool own = drive < 0 || vehicle.drives[static_cast<std::size_t>(drive)].coupling ==
                                        Coupling::kDifferential;
      if (own) layout.rim[i] = Number(layout.size++);
    }
  }
  layouts_[0].drive[0] = vehicle.steered() ? 2 : 1;
  if (vehicle.steered()) {
    layouts_[0].psi = 1;
  } else {
    layouts_[0].drive[1] = 2;
  }
  layouts_[1].v_x = 1;
  layouts_[1].yaw = 2;
}

Motion::Given Mechanics::GivenOf(const Motion& motion) const noexcept {
  for (std::size_t d = 0; d < vehicle_.drives.size(); ++d) {
    if (std::fabs(motion.rim_speed_m_per_s[d]) > 0) return motion.given;
  }
  return Motion::Given::kTwist;
}

bool Mechanics::Begin(Lane* lane) const noexcept {
  const Motion& m = *lane->motion;
  double sum = m.v_x_m_per_s + m.yaw_rate_rad_per_s + m.steering_rad + m.acceleration_m_per_s2 +
               m.yaw_acceleration_rad_per_s2 + m.grade_rad + m.bank_rad + m.worse_by_sd;
  double fastest = 0;
  for (std::size_t d = 0; d < vehicle_.drives.size(); ++d) {
    sum += m.rim_speed_m_per_s[d];
    fastest = std::max(fastest, std::fabs(m.rim_speed_m_per_s[d]));
  }
  if (!std::isfinite(sum)) return false;
  const double uphill = std::cos(m.grade_rad), level = uphill * std::cos(m.bank_rad);
  if (!(uphill > kSteepest) || !(level > kSteepest)) return false;
  lane->scale = 1;
  const bool twist = GivenOf(m) == Motion::Given::kTwist;
  lane->layout = &layout(GivenOf(m));
  lane->v_x = twist && m.given == Motion::Given::kTwist ? m.v_x_m_per_s : 0;
  lane->yaw = twist && m.given == Motion::Given::kTwist ? m.yaw_rate_rad_per_s : 0;
  lane->speed = twist ? std::max(std::fabs(lane->v_x), std::fabs(lane->yaw) * length_) : fastest;
  if (twist && lane->speed < kCreep) {
    lane->scale = lane->speed / kCreep;
    lane->v_x = lane->speed == 0 ? kCreep : lane->v_x / lane->scale;
    lane->yaw = lane->speed == 0 ? 0 : lane->yaw / lane->scale;
    lane->speed = kCreep;
  }
  const double g = vehicle_.gravity_m_per_s2;
  lane->load = weight_ * level;
  lane->gravity_x = g * std::sin(m.grade_rad);
  lane->gravity_y = g * uphill * std::sin(m.bank_rad);
  lane->unit.fill(lane->speed);
  lane->unit[static_cast<std::size_t>(lane->layout->moment)] = weight_ * mean_radius_;
  if (lane->layout->psi >= 0) lane->unit[static_cast<std::size_t>(lane->layout->psi)] = 1;
  if (lane->layout->yaw >= 0) {
    lane->unit[static_cast<std::size_t>(lane->layout->yaw)] = lane->speed / length_;
  }
  lane->evaluations = lane->attempt = 0;
  return true;
}

// The speed of a drive's rims that roll without slip, by the mean of its wheels.
double Mechanics::Command(std::size_t drive, double v_x, double yaw) const noexcept {
  if (vehicle_.drives[drive].coupling == Coupling::kIndependent && vehicle_.steered()) {
    return (v_x < 0 ? -1 : 1) * std::hypot(v_x, yaw * vehicle_.steering.length_m);
  }
  double sum = 0, count = 0;
  for (const Wheel& w : vehicle_.wheels) {
    if (w.drive != Number(drive)) continue;
    sum += v_x - yaw * w.y_m;
    ++count;
  }
  return sum / count;
}

// The velocity of a wheel's hub along its heading.
double Mechanics::AlongWheel(const Twist& t, std::size_t i) const noexcept {
  const Wheel& w = vehicle_.wheels[i];
  const double x = t.v_x - t.yaw * w.y_m, y = t.v_y + t.yaw * w.x_m;
  if (!w.steered) return x;
  const double along = (w.x_m - vehicle_.steering.centre_x_m) / vehicle_.steering.length_m;
  const double a = t.cos - t.sin * w.y_m / vehicle_.steering.length_m, b = t.sin * along;
  return (a * x + b * y) / std::max(std::sqrt(a * a + b * b), 1e-9);
}

// Wheels with a speed of their own roll along their heading: on ice a free wheel that begins some
// percent off slides as a whole, and from there balances are missed that exist.
void Mechanics::Guess(Lane* lane) const noexcept {
  const Layout& l = *lane->layout;
  const Motion& m = *lane->motion;
  Column& x = lane->at;
  x.fill(0);
  double v_x = lane->v_x, yaw = lane->yaw;
  const double sense = v_x < 0 ? -1 : 1;
  const auto guess = static_cast<std::size_t>(lane->attempt - (lane->warm ? 1 : 0));
  // Later guesses: slip in the sense of the pull that is asked for, and of the turn.
  const double pull = m.acceleration_m_per_s2 + lane->gravity_x < 0 ? -1 : 1;
  const double more = std::array{0.0, 0.3, 1.5, -0.4}[guess];
  if (l.v_x >= 0) {
    double sum = 0, turn = 0, arm = 0, driven = 0;
    for (const Wheel& w : vehicle_.wheels) {
      if (w.drive < 0) continue;
      const double rim = m.rim_speed_m_per_s[static_cast<std::size_t>(w.drive)];
      sum += rim;
      ++driven;
      turn -= rim * w.y_m;
      arm += w.y_m * w.y_m;
    }
    const double share = std::array{1.0, 0.5, 0.1, 0.8}[guess];
    v_x = sum / driven * (1 - 0.3 * pull * more);
    yaw = vehicle_.steered() ? v_x * std::tan(m.steering_rad) / vehicle_.steering.length_m
                             : share * turn / arm;
    x[1] = v_x;
    x[2] = yaw;
  } else {
    for (std::size_t d = 0; d < vehicle_.drives.size(); ++d) {
      x[static_cast<std::size_t>(l.drive[d])] =
          Command(d, v_x, yaw * (1 + std::fabs(more))) + pull * more * lane->speed;
    }
    if (l.psi >= 0) x[1] = std::atan2(sense * yaw * vehicle_.steering.length_m, sense * v_x);
  }
  x[0] = -yaw * middle_x_;
  for (std::size_t i = 0; i < wheels(); ++i) {
    if (l.rim[i] < 0) continue;
    const Wheel& w = vehicle_.wheels[i];
    x[static_cast<std::size_t>(l.rim[i])] = AlongWheel(TwistOf(*lane, x), i);
    if (w.drive >= 0) x[static_cast<std::size_t>(l.rim[i])] += pull * more * lane->speed;
  }
}

bool Mechanics::Recall(const Solution& from, bool unbalanced, Lane* lane) const noexcept {
  const Layout& l = *lane->layout;
  if (!(from.balanced || (unbalanced && std::isfinite(from.residual)))) return false;
  // What was found for another speed, in proportion.
  double before =
      std::max(std::fabs(from.v_x_m_per_s), std::fabs(from.yaw_rate_rad_per_s) * length_);
  if (l.v_x >= 0) {
    before = 0;
    for (std::size_t d = 0; d < vehicle_.drives.size(); ++d) {
      before = std::max(before, std::fabs(from.rim_speed_m_per_s[d]));
    }
  }
  if (!(before > 0)) return false;
  const double ratio = lane->speed / before;
  lane->at[0] = from.v_y_m_per_s * ratio;
  if (l.v_x >= 0) {
    lane->at[static_cast<std::size_t>(l.v_x)] = from.v_x_m_per_s * ratio;
    lane->at[static_cast<std::size_t>(l.yaw)] = from.yaw_rate_rad_per_s * ratio;
  }
  lane->at[static_cast<std::size_t>(l.moment)] = from.pitching_moment_n_m;
  if (l.psi >= 0) lane->at[1] = from.steering_rad;
  for (std::size_t d = 0; d < vehicle_.drives.size(); ++d) {
    if (l.drive[d] < 0) continue;
    lane->at[static_cast<std::size_t>(l.drive[d])] = from.rim_speed_m_per_s[d] * ratio;
  }
  for (std::size_t i = 0; i < wheels(); ++i) {
    if (l.rim[i] < 0) continue;
    lane->at[static_cast<std::size_t>(l.rim[i])] = from.wheel[i].rim_speed_m_per_s * ratio;
  }
  return true;
}

Mechanics::Twist Mechanics::TwistOf(const Lane& lane, const Column& at) const noexcept {
  const Layout& l = *lane.layout;
  const bool given = l.v_x < 0;
  Twist t{given ? lane.v_x : at[1], at[0], given ? lane.yaw : at[2],
          l.psi >= 0 ? at[1]
          : given    ? 0
                     : lane.motion->steering_rad};
  if (steered_) {
    t.cos = std::cos(t.psi);
    t.sin = std::sin(t.psi);
  }
  return t;
}

pack::Body Mechanics::Body() const noexcept {
  pack::Body b{};
  b.wheels = Number(wheels());
  b.steered = steered_;
  b.mass = vehicle_.mass_kg;
  b.centre_x = vehicle_.centre_x_m;
  b.centre_y = vehicle_.centre_y_m;
  b.centre_z = vehicle_.centre_z_m;
  b.yaw_inertia = vehicle_.yaw_inertia_kg_m2;
  std::copy(per_.begin(), per_.end(), b.per);
  support_.Describe(&b);
  for (std::size_t i = 0; i < wheels(); ++i) {
    const Wheel& w = vehicle_.wheels[i];
    const auto drive = static_cast<std::size_t>(w.drive);
    pack::Body::Wheel& to = b.wheel[i];
    to.x = w.x_m;
    to.y = w.y_m;
    to.radius = radius(i);
    to.per_radius = 1 / radius(i);
    to.across = w.y_m / vehicle_.steering.length_m;
    to.along = (w.x_m - vehicle_.steering.centre_x_m) / vehicle_.steering.length_m;
    to.steered = steered_ && w.steered;
    to.drive = w.drive;
    to.follows = w.drive >= 0 && vehicle_.drives[drive].coupling == Coupling::kIndependent;
    to.first = w.drive >= 0 ? Number(first_[drive]) : Number(i);
  }
  return b;
}

pack::Unknowns Mechanics::UnknownsOf(const Layout& l) noexcept {
  pack::Unknowns u{Number(l.size), l.v_x, l.yaw, l.psi, l.moment, {}, {}};
  std::copy(l.drive.begin(), l.drive.end(), u.drive);
  std::copy(l.rim.begin(), l.rim.end(), u.rim);
  return u;
}

}  // namespace grouser::vehicle
