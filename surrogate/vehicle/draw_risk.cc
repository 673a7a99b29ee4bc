// Probabilities by coherent draws.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "surrogate/vehicle/solve_all.h"
#include "surrogate/vehicle/speed_plan.h"

namespace grouser::vehicle {

double ShareOf(std::span<const std::uint8_t> draws) {
  const auto going = std::count(draws.begin(), draws.end(), 1);
  return static_cast<double>(going) / static_cast<double>(draws.size());
}

void SpeedPlanner::UseDraws(std::shared_ptr<const GroundDraws> draws) {
  if (draws != nullptr) {
    drawn_motions_.resize(kMostSolvesToStop);
    drawn_.resize(kMostSolvesToStop);
    least_.resize(draws->count());
    most_.resize(draws->count());
  }
  solver_.UseDraws(draws);
  draws_ = std::move(draws);
}

void SpeedPlanner::KeepGoing(const Motion& motion, const SpeedOptions& o,
                             std::span<std::uint8_t> least, std::span<std::uint8_t> most) {
  KeepGoing({&motion, 1}, o, least, most);
}

void SpeedPlanner::KeepGoing(std::span<const Motion> motions, const SpeedOptions& o,
                             std::span<std::uint8_t> least, std::span<std::uint8_t> most) {
  Need(draws_ != nullptr, "draws", "some (UseDraws)");
  constexpr std::size_t kSideBySide = 16;
  std::array<Motion, kSideBySide> means;
  std::array<Solution, kSideBySide> solutions;
  const auto none_is_left = [most] {
    return std::none_of(most.begin(), most.end(), [](std::uint8_t goes) { return goes != 0; });
  };
  for (std::size_t first = 0; first < motions.size(); first += kSideBySide) {
    const std::size_t some = std::min(kSideBySide, motions.size() - first);
    for (std::size_t k = 0; k < some; ++k) {
      means[k] = motions[first + k];
      means[k].worse_by_sd = 0;
      means[k].draw = Motion::kMeanGround;
    }
    if (none_is_left()) return;
    SolveAll(&solver_, std::span(means).first(some), std::span(solutions).first(some), o.stop);
    for (std::size_t k = 0; k < some; ++k) {
      if (none_is_left()) return;
      KeepGoingFrom(means[k], solutions[k], o, least, most);
    }
  }
}

// From the mean ground's solution, and where that finds nothing with all starts.
void SpeedPlanner::KeepGoingFrom(const Motion& motion, const Solution& mean, const SpeedOptions& o,
                                 std::span<std::uint8_t> least, std::span<std::uint8_t> most) {
  constexpr Effort kWarm{.warm = true, .attempts = 5};
  for (std::size_t next = 0; next < most.size();) {
    std::size_t some = 0;
    for (; next < most.size() && some < kMostSolvesToStop; ++next) {
      if (most[next] == 0) continue;
      drawn_motions_[some] = motion;
      drawn_motions_[some].draw = static_cast<int>(next);
      drawn_[some++] = mean;
    }
    StopIfAsked(o.stop);
    solver_.Solve(std::span(drawn_motions_).first(some), std::span(drawn_).first(some), kWarm);
    for (std::size_t k = 0; k < some; ++k) {
      const auto draw = static_cast<std::size_t>(drawn_motions_[k].draw);
      if (!Goes(drawn_[k], o, false)) least[draw] = 0;
      if (!Goes(drawn_[k], o, true)) most[draw] = 0;
    }
  }
}

GoProbability SpeedPlanner::ProbabilityByDraws(const Motion& motion, const SpeedOptions& o) {
  std::fill(least_.begin(), least_.end(), 1);
  std::fill(most_.begin(), most_.end(), 1);
  KeepGoing(motion, o, least_, most_);
  return {ShareOf(least_), ShareOf(most_)};
}

double SpeedPlanner::PlanByDraws(std::span<const PathPoint> path, const SpeedOptions& options,
                                 std::span<const SpeedPoint> plan, std::span<double> by_point) {
  Need(draws_ != nullptr, "draws", "some (UseDraws)");
  Need(by_point.empty() || by_point.size() == path.size(), "by_point",
       "as many as points, or none");
  CheckPath(path, options, plan.size());
  constexpr Effort kWarm{.warm = true, .attempts = 5, .goal = Solution::kTolerance, .brief = true};
  const std::size_t n = path.size(), count = draws_->count();
  SpeedOptions o = options;
  o.worse_by_sd = 0;
  const auto solve = [&](int draw, std::size_t first, std::size_t some) {
    for (std::size_t i = 0; i < some; ++i) {
      const SpeedPoint& p = plan[first + i];
      motions_[first + i] = MotionAt(path[first + i], o, p.speed_m_per_s, p.acceleration_m_per_s2);
      motions_[first + i].draw = draw;
      if (draw >= 0) tried_[first + i] = solutions_[first + i];
    }
    StopIfAsked(o.stop);
    solver_.Solve(std::span(motions_).subspan(first, some),
                  std::span(draw < 0 ? solutions_ : tried_).subspan(first, some),
                  draw < 0 ? Effort{.goal = Solution::kTolerance, .brief = true} : kWarm);
  };
  std::fill(by_point.begin(), by_point.end(), 0.0);
  std::size_t holding = 0;
  for (int draw = Motion::kMeanGround; draw < static_cast<int>(count); ++draw) {
    bool all = true;
    for (std::size_t first = 0; first < n; first += kMostSolvesToStop) {
      const std::size_t some = std::min(kMostSolvesToStop, n - first);
      solve(draw, first, some);
      for (std::size_t i = first; draw >= 0 && i < first + some; ++i) {
        const bool holds = MayHold(o, plan, i) && Good(tried_[i], o);
        all = all && holds;
        if (!by_point.empty() && holds) by_point[i] += 1;
      }
      if (by_point.empty() && !all) break;
    }
    holding += draw >= 0 && all;
  }
  for (double& p : by_point) p /= static_cast<double>(count);
  return static_cast<double>(holding) / static_cast<double>(count);
}

}  // namespace grouser::vehicle
