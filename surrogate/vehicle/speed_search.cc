#include <algorithm>
#include <cmath>

#include "surrogate/vehicle/speed_plan.h"

namespace grouser::vehicle {
namespace {

constexpr int kBisections = 8;      // of the safe speed: to 0.4 % of the limit
constexpr std::size_t kStride = 8;  // points between those whose reach is searched

}  // namespace

// At the limit, then at rest, then by halves; all points of a round in one batch.
void SpeedPlanner::Safe(std::span<const PathPoint> path, const SpeedOptions& o,
                        std::span<SpeedPoint> out) {
  std::size_t open = path.size();
  for (std::size_t i = 0; i < open; ++i) {
    open_[i] = i;
    low_[i] = -1;  // not known to be possible at all
    high_[i] = o.speed_limit_m_per_s;
  }
  for (int round = 0; round < kBisections + 2 && open > 0; ++round) {
    const auto speed = [&](std::size_t i) {
      return round == 0 ? high_[i] : round == 1 ? 0 : (low_[i] + high_[i]) / 2;
    };
    for (std::size_t k = 0; k < open; ++k) {
      motions_[k] = MotionAt(path[open_[k]], o, speed(open_[k]), 0);
    }
    solver_.Solve(std::span(motions_).first(open), std::span(solutions_).first(open), false);
    std::size_t left = 0;
    for (std::size_t k = 0; k < open; ++k) {
      const std::size_t i = open_[k];
      const bool good = Good(solutions_[k], o);
      if (good) low_[i] = speed(i);
      if (!good) {
        high_[i] = speed(i);
        out[i].safe_binding = BindingOf(motions_[k], solutions_[k], o);
        out[i].shortfall = ShortfallOf(solutions_[k], o);
      }
      if (round == 0 && good) {
        out[i].safe_binding = Binding::kSpeedLimit;
        out[i].shortfall = 0;
        continue;
      }
      if (round == 1 && !good) continue;  // cannot be driven
      open_[left++] = i;
      if (round == 1) high_[i] = o.speed_limit_m_per_s;
    }
    open = left;
  }
  for (std::size_t i = 0; i < path.size(); ++i) out[i].safe_m_per_s = std::max(0.0, low_[i]);
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

// Acceleration and braking within comfort that hold at rest: by halves at the knots, the least
// of both neighbours between.
void SpeedPlanner::Reach(std::span<const PathPoint> path, const SpeedOptions& o,
                         std::span<const SpeedPoint> out) {
  const std::size_t knots = Knots(path, out);
  for (const bool faster : {true, false}) {
    std::vector<double>& reach = faster ? faster_ : slower_;
    const double most = faster ? o.acceleration_m_per_s2 : o.braking_m_per_s2;
    for (std::size_t k = 0; k < knots; ++k) {
      low_[k] = 0;
      high_[k] = 2 * most;  // the first try: what is asked
    }
    for (int round = 0; round < 6; ++round) {
      for (std::size_t k = 0; k < knots; ++k) {
        const double a = (low_[k] + high_[k]) / 2;
        motions_[k] = MotionAt(path[knots_[k]], o, 0, faster ? a : -a);
      }
      solver_.Solve(std::span(motions_).first(knots), std::span(solutions_).first(knots));
      for (std::size_t k = 0; k < knots; ++k) {
        const double a = (low_[k] + high_[k]) / 2;
        if (Good(solutions_[k], o)) {
          low_[k] = a;
          if (round == 0) high_[k] = a;
        } else {
          high_[k] = a;
        }
      }
    }
    // What cannot be driven bears all; a step has one acceleration, which both its ends must bear.
    std::fill(reach.begin(), reach.begin() + static_cast<std::ptrdiff_t>(path.size()), most);
    for (std::size_t k = 0; k < knots; ++k) {
      reach[knots_[k]] = low_[k];
      if (k + 1 == knots || knots_[k + 1] > knots_[k] + kStride) continue;
      for (std::size_t i = knots_[k] + 1; i < knots_[k + 1]; ++i) {
        reach[i] = std::min(low_[k], low_[k + 1]);
      }
    }
    for (std::size_t i = 0; i + 1 < path.size(); ++i) reach[i] = std::min(reach[i], reach[i + 1]);
  }
}

}  // namespace grouser::vehicle
