// Balances that no start finds, from motions beside: continuation (Allgower and Georg, Introduction
// to Numerical Continuation Methods, 2003, ch. 2) in the ground and in the curvature.
#include <algorithm>
#include <cmath>

#include "surrogate/vehicle/solver_work.h"

namespace grouser::vehicle {
namespace {

constexpr double kFirstStep = 0.25, kMostStep = 0.5, kLeastStep = 1.0 / 64;  // of the way
// Of one way. All three, of the motion and of its mirror image, take fewer than 120.
constexpr int kMostSolves = 18;

// Whether more steps may balance it: neither tipped over nor outside of what the models know.
bool Unbalanced(const Solution& s) {
  return !s.balanced && (s.reasons & ~(kNoBalance | kOverTorque)) == 0;
}

/// The motion at share t of the way: `ground` from mean ground, `turn` from straight on (of
/// equal rims).
struct Way {
  bool ground, turn;

  Motion At(const Motion& to, std::size_t drives, double t) const {
    Motion m = to;
    if (ground) m.worse_by_sd *= t;
    if (!turn) return m;
    m.yaw_rate_rad_per_s *= t;
    m.yaw_acceleration_rad_per_s2 *= t;
    m.steering_rad *= t;
    double mean = 0;
    for (std::size_t d = 0; d < drives; ++d) {
      mean += to.rim_speed_m_per_s[d] / static_cast<double>(drives);
    }
    for (std::size_t d = 0; d < drives; ++d) {
      m.rim_speed_m_per_s[d] = std::lerp(mean, to.rim_speed_m_per_s[d], t);
    }
    return m;
  }
};

}  // namespace

// Along one way, from where it begins, if that balances; false: not to its end.
bool Solver::Work::FollowWay(const Motion& motion, bool ground, bool turn,
                             Solution* solution) noexcept {
  constexpr Effort kOn{.warm = true, .attempts = 1, .evaluations = 25};
  const Way way{ground, turn};
  const std::size_t drives = mechanics.vehicle().drives.size();
  Motion at = way.At(motion, drives, 0);
  if (mechanics.GivenOf(at) != mechanics.GivenOf(motion)) return false;  // at rest halfway
  Solution good;
  SolveOne(at, Effort{}, &good);
  int evaluations = good.evaluations;
  double t = 0, step = kFirstStep;
  for (int k = 0; k < kMostSolves && good.balanced && t < 1; ++k) {
    const double next = std::min(1.0, t + step);
    at = way.At(motion, drives, next);
    Solution tried = good;
    SolveOne(at, kOn, &tried);
    evaluations += tried.evaluations;
    if (tried.balanced) {
      t = next;
      step = std::min(2 * step, kMostStep);
      good = tried;
    } else if ((step /= 2) < kLeastStep) {
      return false;
    }
  }
  if (!good.balanced || t < 1) return false;
  good.evaluations = evaluations;
  *solution = good;
  return true;
}

void Solver::Work::Follow(const Motion& motion, Solution* solution) noexcept {
  if (!Unbalanced(*solution) || FollowWays(motion, solution)) return;
  FollowMirror(motion, solution);
}

bool Solver::Work::FollowWays(const Motion& motion, Solution* solution) noexcept {
  const bool ground = motion.worse_by_sd != 0;
  bool turn = motion.yaw_rate_rad_per_s != 0 && motion.v_x_m_per_s != 0;
  if (mechanics.GivenOf(motion) == Motion::Given::kControls) {
    const auto& rim = motion.rim_speed_m_per_s;
    turn = motion.steering_rad != 0 ||
           std::any_of(rim.begin(),
                       rim.begin() + static_cast<std::ptrdiff_t>(mechanics.vehicle().drives.size()),
                       [&](double r) { return r != rim[0]; });
  }
  if (ground && FollowWay(motion, true, false, solution)) return true;
  if (turn && FollowWay(motion, false, true, solution)) return true;
  return ground && turn && FollowWay(motion, true, true, solution);
}

}  // namespace grouser::vehicle
