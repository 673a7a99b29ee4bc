#pragma once

#include <cstddef>
#include <span>

#include "surrogate/vehicle/path_search.h"
#include "surrogate/vehicle/speed_plan.h"

namespace grouser::vehicle {

/// What a planner asks of the points of a path: speeds, or accelerations at given speeds, by
/// levels.
class SpeedPlanner::Question final : public PathQuestion {
 public:
  /// Level l: speed l step.
  Question(const SpeedPlanner& planner, const SpeedOptions& options, double step)
      : planner_(planner), options_(options), step_(step) {}
  /// Level l: acceleration l step most[i] at the speed at[i], of points of the path, from whose
  /// last solutions it begins.
  Question(const SpeedPlanner& planner, const SpeedOptions& options, double step,
           std::span<const double> at, std::span<const std::size_t> points,
           std::span<const double> most)
      : planner_(planner), options_(options), step_(step), at_(at), points_(points), most_(most) {}

  Motion MotionAt(const PathPoint& p, std::size_t i, int level) const override {
    return at_.empty() ? SpeedPlanner::MotionAt(p, options_, step_ * level, 0)
                       : SpeedPlanner::MotionAt(p, options_, at_[i], step_ * level * most_[i]);
  }
  double Slack(const Solution& s) const override { return planner_.Slack(s, options_); }
  double Shortfall(const Solution& s) const override { return planner_.ShortfallOf(s, options_); }
  Binding BindingOf(const Motion& m, const Solution& s) const override {
    return planner_.BindingOf(m, s, options_);
  }
  const Solution* Near(std::size_t i) const override {
    return points_.empty() ? nullptr : &planner_.solutions_[points_[i]];
  }

 private:
  const SpeedPlanner& planner_;
  const SpeedOptions& options_;
  double step_;
  std::span<const double> at_;
  std::span<const std::size_t> points_;
  std::span<const double> most_;
};

}  // namespace grouser::vehicle
