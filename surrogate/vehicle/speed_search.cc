#include <algorithm>
#include <cmath>

#include "surrogate/vehicle/speed_plan.h"

namespace grouser::vehicle {
namespace {

constexpr int kSpeedLevels = 256;   // of the safe speed: 0.4 % of the limit
constexpr int kReachLevels = 32;    // of acceleration and braking
constexpr std::size_t kStride = 8;  // points between those whose reach is searched
constexpr double kNoticed = 0.004;  // change of grade, bank and lateral acceleration over gravity
constexpr double kFarBelow = 0.15;  // a neighbour, of its speed

// Whether the limit of grip is that of the point before although the motion has changed.
bool Stays(std::span<const PathPoint> path, std::span<const SpeedPoint> out, std::size_t i,
           double gravity) {
  if (i == 0 || path[i].soil != path[i - 1].soil) return false;
  const double v = out[i].safe_m_per_s;
  const Binding b = out[i].safe_binding;
  if (!(v > 0) || v != out[i - 1].safe_m_per_s) return false;
  if (b != Binding::kTraction && b != Binding::kLateralGrip) return false;
  const PathPoint &p = path[i], &q = path[i - 1];
  const double change = std::fabs(p.grade_rad - q.grade_rad) + std::fabs(p.bank_rad - q.bank_rad) +
                        v * v / gravity * std::fabs(p.curvature_per_m - q.curvature_per_m);
  return change > kNoticed;
}

double StepOf(const SpeedOptions& o) { return o.speed_limit_m_per_s / kSpeedLevels; }

bool Same(const PathPoint& a, const PathPoint& b) {
  return a.soil == b.soil && a.curvature_per_m == b.curvature_per_m && a.grade_rad == b.grade_rad &&
         a.bank_rad == b.bank_rad;
}

}  // namespace

// The solution at the safe speed stays in solutions_.
void SpeedPlanner::Safe(std::span<const PathPoint> path, const SpeedOptions& o,
                        std::span<SpeedPoint> out) {
  search_.Run(
      &solver_, path.size(), 1, kSpeedLevels,
      [&](std::size_t i, int level) { return MotionAt(path[i], o, StepOf(o) * level, 0); },
      [&](const Solution& s) { return Slack(s, o); },
      [&](const Solution& s) { return ShortfallOf(s, o); },
      [&](std::size_t i) { return Same(path[i], path[i - 1]); },
      [&](std::size_t i) { return path[i].soil != path[i - 1].soil; },
      [](std::size_t, LevelSearch::Track*) {},
      [&](std::size_t i, const LevelSearch::Track& t) { Found(t, o, i, out); });
  Raise(path, o, out);
}

void SpeedPlanner::Found(const LevelSearch::Track& t, const SpeedOptions& o, std::size_t i,
                         std::span<SpeedPoint> out) {
  SpeedPoint& p = out[i];
  p.safe_m_per_s = StepOf(o) * std::max(0, t.low);
  solutions_[i] = t.good;
  p.safe_binding = Binding::kSpeedLimit;
  p.shortfall = t.shortfall;
  if (t.low < kSpeedLevels) p.safe_binding = BindingOf(t.failed.motion, t.failed.solution, o);
}

// Points far below a neighbour are searched once more, from its speed and its solution down; those
// that rise may raise their neighbours, so that runs fill from both ends. Points that stay are from
// as far above themselves.
void SpeedPlanner::Raise(std::span<const PathPoint> path, const SpeedOptions& o,
                         std::span<SpeedPoint> out) {
  const auto level = [&](std::size_t i) {
    return static_cast<int>(std::lround(out[i].safe_m_per_s / StepOf(o)));
  };
  std::fill(risen_.begin(), risen_.end(), true);
  for (std::size_t low = Low(path, out); low > 0; low = Low(path, out)) {
    search_.Run(
        &solver_, low, 1, kSpeedLevels,
        [&](std::size_t k, int l) { return MotionAt(path[knots_[k]], o, StepOf(o) * l, 0); },
        [&](const Solution& s) { return Slack(s, o); },
        [&](const Solution& s) { return ShortfallOf(s, o); }, [](std::size_t) { return false; },
        [](std::size_t) { return true; },
        [&](std::size_t k, LevelSearch::Track* t) {
          const std::size_t from = higher_[k], at = knots_[k];
          const double most = from == at ? level(at) / (1 - kFarBelow) : level(from);
          LevelSearch::BeginAt(std::min<int>(kSpeedLevels, std::ceil(most)), solutions_[from], t);
          if (out[knots_[k]].safe_m_per_s > 0) t->low = level(knots_[k]);
        },
        [&](std::size_t k, const LevelSearch::Track& t) {
          if (!t.here) return;  // none above the one that was known
          Found(t, o, knots_[k], out);
          risen_[knots_[k]] = true;
        });
  }
}

// Points that are far below a neighbour on their soil which has risen, to knots_, and the highest
// such neighbour, to higher_; at first (all have risen) also points that stay where the point
// before is, themselves in higher_. Returns how many; none has risen then.
std::size_t SpeedPlanner::Low(std::span<const PathPoint> path, std::span<const SpeedPoint> out) {
  const bool first = std::count(risen_.begin(), risen_.end(), false) == 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double least = out[i].safe_m_per_s / (1 - kFarBelow);
    std::size_t from = i;
    for (const std::size_t k : {i - 1, i + 1}) {  // 0 - 1 is beyond the path, too
      if (k >= path.size() || !risen_[k] || path[k].soil != path[i].soil) continue;
      const double v = out[k].safe_m_per_s;
      if (v > least && (from == i || v > out[from].safe_m_per_s)) from = k;
    }
    if (from == i && !(first && Stays(path, out, i, vehicle_.gravity_m_per_s2))) continue;
    knots_[count] = i;
    higher_[count++] = from;
  }
  std::fill(risen_.begin(), risen_.end(), false);
  return count;
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
  // Items: the knots for acceleration, then again for braking.
  const auto faster = [&](std::size_t k) { return k < knots; };
  const auto at = [&](std::size_t k) { return knots_[k % knots]; };
  const auto most = [&](std::size_t k) {
    return faster(k) ? o.acceleration_m_per_s2 : o.braking_m_per_s2;
  };
  // What cannot be driven bears all; a step has one acceleration, which both its ends must bear.
  std::fill_n(faster_.begin(), path.size(), o.acceleration_m_per_s2);
  std::fill_n(slower_.begin(), path.size(), o.braking_m_per_s2);
  if (knots == 0) return;
  search_.Run(
      &solver_, 2 * knots, 2, kReachLevels,
      [&](std::size_t k, int level) {
        const double step = (faster(k) ? 1 : -1) * most(k) / kReachLevels;
        return MotionAt(path[at(k)], o, 0, step * level);
      },
      [&](const Solution& s) { return Slack(s, o); },
      [&](const Solution& s) { return ShortfallOf(s, o); },
      [&](std::size_t k) { return k != knots && Same(path[at(k)], path[at(k - 1)]); },
      [&](std::size_t k) { return k == knots || path[at(k)].soil != path[at(k - 1)].soil; },
      [](std::size_t, LevelSearch::Track*) {},
      [&](std::size_t k, const LevelSearch::Track& t) {
        (faster(k) ? faster_ : slower_)[at(k)] = most(k) / kReachLevels * std::max(0, t.low);
      });
  for (std::vector<double>* all : {&faster_, &slower_}) {
    std::vector<double>& reach = *all;
    for (std::size_t k = 0; k + 1 < knots; ++k) {
      const std::size_t a = knots_[k], b = knots_[k + 1];
      if (b > a + kStride) continue;
      for (std::size_t i = a + 1; i < b; ++i) reach[i] = std::min(reach[a], reach[b]);
    }
    for (std::size_t i = 0; i + 1 < path.size(); ++i) reach[i] = std::min(reach[i], reach[i + 1]);
  }
}

}  // namespace grouser::vehicle
