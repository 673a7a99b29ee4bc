// Balances that are found of the motion's mirror image alone: searches end by
// chance of rounding on ground on which little balances, and no side of a vehicle is another.
#include <cmath>
#include <optional>

#include "surrogate/vehicle/solver_work.h"

namespace grouser::vehicle {
namespace {

/// Which wheel and drive stands at the same place on the other side.
struct Opposites {
  std::array<std::size_t, kMostWheels> wheel{};
  std::array<std::size_t, kMostDrives> drive{};
};
// None where the vehicle is not its own mirror image.
std::optional<Opposites> OppositesOf(const Vehicle& v) {
  Opposites opposites;
  if (v.centre_y_m != 0) return std::nullopt;
  for (std::size_t i = 0; i < v.wheels.size(); ++i) {
    std::size_t other = 0;
    while (other < v.wheels.size() &&
           (v.wheels[other].x_m != v.wheels[i].x_m || v.wheels[other].y_m != -v.wheels[i].y_m)) {
      ++other;
    }
    if (other == v.wheels.size()) return std::nullopt;
    opposites.wheel[i] = other;
    const int drive = v.wheels[i].drive, opposite = v.wheels[other].drive;
    if ((drive < 0) != (opposite < 0)) return std::nullopt;
    if (drive >= 0)
      opposites.drive[static_cast<std::size_t>(drive)] = static_cast<std::size_t>(opposite);
  }
  return opposites;
}

Motion MirrorOf(const Vehicle& v, const Opposites& opposites, const Motion& motion) {
  Motion m = motion;
  m.yaw_rate_rad_per_s *= -1;
  m.yaw_acceleration_rad_per_s2 *= -1;
  m.bank_rad *= -1;
  m.steering_rad *= -1;
  for (std::size_t i = 0; i < v.wheels.size(); ++i) m.soil[opposites.wheel[i]] = motion.soil[i];
  for (std::size_t d = 0; d < v.drives.size(); ++d) {
    m.rim_speed_m_per_s[opposites.drive[d]] = motion.rim_speed_m_per_s[d];
  }
  return m;
}

// What a warm search begins with.
Solution MirrorOf(const Vehicle& v, const Opposites& opposites, const Solution& solution) {
  Solution s = solution;
  s.v_y_m_per_s *= -1;
  s.yaw_rate_rad_per_s *= -1;
  s.steering_rad *= -1;
  s.interval_slope = {};
  for (std::size_t d = 0; d < v.drives.size(); ++d) {
    s.rim_speed_m_per_s[opposites.drive[d]] = solution.rim_speed_m_per_s[d];
  }
  for (std::size_t i = 0; i < v.wheels.size(); ++i) s.wheel[opposites.wheel[i]] = solution.wheel[i];
  return s;
}

}  // namespace

bool Solver::Work::FollowMirror(const Motion& motion, Solution* solution) noexcept {
  const Vehicle& v = mechanics.vehicle();
  const std::optional<Opposites> opposites = OppositesOf(v);
  if (!opposites) return false;
  const Motion mirror = MirrorOf(v, *opposites, motion);
  Solution other;
  SolveOne(mirror, Effort{}, &other);
  if (!other.balanced && !FollowWays(mirror, &other)) return false;
  Solution tried = MirrorOf(v, *opposites, other);
  SolveOne(motion, Effort{.warm = true, .attempts = 1}, &tried);
  if (!tried.balanced) return false;
  tried.evaluations += other.evaluations;
  *solution = tried;
  return true;
}

}  // namespace grouser::vehicle
