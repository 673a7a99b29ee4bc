#include <algorithm>
#include <cmath>

#include "surrogate/vehicle/speed_plan.h"

namespace grouser::vehicle {
namespace {

constexpr int kSpeedLevels = 256;   // of the safe speed: 0.4 % of the limit
constexpr int kReachLevels = 32;    // of acceleration and braking
constexpr std::size_t kStride = 8;  // points between those whose reach is searched

bool Same(const PathPoint& a, const PathPoint& b) {
  return a.soil == b.soil && a.curvature_per_m == b.curvature_per_m && a.grade_rad == b.grade_rad &&
         a.bank_rad == b.bank_rad;
}

}  // namespace

// The solution at the safe speed stays in solutions_.
void SpeedPlanner::Safe(std::span<const PathPoint> path, const SpeedOptions& o,
                        std::span<SpeedPoint> out) {
  const double step = o.speed_limit_m_per_s / kSpeedLevels;
  search_.Run(
      &solver_, path.size(), kSpeedLevels,
      [&](std::size_t i, int level) { return MotionAt(path[i], o, step * level, 0); },
      [&](const Solution& s) { return Slack(s, o); },
      [&](const Solution& s) { return ShortfallOf(s, o); },
      [&](std::size_t i) { return Same(path[i], path[i - 1]); },
      [&](std::size_t i) { return path[i].soil != path[i - 1].soil; },
      [&](std::size_t i, const LevelSearch::Track& t) {
        SpeedPoint& p = out[i];
        p.safe_m_per_s = step * std::max(0, t.low);
        solutions_[i] = t.good;
        p.safe_binding = Binding::kSpeedLimit;
        p.shortfall = t.shortfall;
        if (t.low == kSpeedLevels) return;
        p.safe_binding = BindingOf(t.failed.motion, t.failed.solution, o);
      });
}

// Points whose reach is searched: both ends of every stretch of one soil that can be driven, and
// every eighth point between. Returns how many.
std::size_t SpeedPlanner::Knots(std::span<const PathPoint> path, std::span<const SpeedPoint> out) {
  const std::size_t n = path.size();
  const auto drives = [&](std::size_t i) { return out[i].safe_m_per_s > 0; };
  const auto joined = [&](std::size_t i) {  // with the next point
    return i + 1 < n && drives(i + 1) && path[i + 1].soil == path[i].soil;
  };
  std::size_t count = 0, since = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (!drives(i)) continue;
    const bool begins = i == 0 || !drives(i - 1) || !joined(i - 1);
    if (!begins && joined(i) && ++since < kStride) continue;
    knots_[count++] = i;
    since = 0;
  }
  return count;
}

// Acceleration and braking within comfort that hold at rest: searched at the knots, the least of
// both neighbours between.
void SpeedPlanner::Reach(std::span<const PathPoint> path, const SpeedOptions& o,
                         std::span<const SpeedPoint> out) {
  const std::size_t knots = Knots(path, out);
  for (const bool faster : {true, false}) {
    std::vector<double>& reach = faster ? faster_ : slower_;
    const double most = faster ? o.acceleration_m_per_s2 : o.braking_m_per_s2;
    const double step = (faster ? most : -most) / kReachLevels;
    // What cannot be driven bears all; a step has one acceleration, which both its ends must bear.
    std::fill(reach.begin(), reach.begin() + static_cast<std::ptrdiff_t>(path.size()), most);
    search_.Run(
        &solver_, knots, kReachLevels,
        [&](std::size_t k, int level) { return MotionAt(path[knots_[k]], o, 0, step * level); },
        [&](const Solution& s) { return Slack(s, o); },
        [&](const Solution& s) { return ShortfallOf(s, o); },
        [&](std::size_t k) { return Same(path[knots_[k]], path[knots_[k - 1]]); },
        [&](std::size_t k) { return path[knots_[k]].soil != path[knots_[k - 1]].soil; },
        [&](std::size_t k, const LevelSearch::Track& t) {
          reach[knots_[k]] = std::fabs(step) * std::max(0, t.low);
        });
    for (std::size_t k = 0; k + 1 < knots; ++k) {
      const std::size_t a = knots_[k], b = knots_[k + 1];
      if (b > a + kStride) continue;
      for (std::size_t i = a + 1; i < b; ++i) reach[i] = std::min(reach[a], reach[b]);
    }
    for (std::size_t i = 0; i + 1 < path.size(); ++i) reach[i] = std::min(reach[i], reach[i + 1]);
  }
}

}  // namespace grouser::vehicle
