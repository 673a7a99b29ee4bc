// How fast each point of a path is driven at constant speed.
#include <algorithm>
#include <cmath>

#include "surrogate/vehicle/speed_plan.h"

namespace grouser::vehicle {
namespace {

constexpr int kSpeedLevels = 256;     // of the safe speed: 0.4 % of the limit
constexpr std::size_t kSpacing = 64;  // points between those that are searched from nothing
constexpr double kNoticed = 0.004;    // change of grade, bank and lateral acceleration over gravity
constexpr double kFarBelow = 0.15;    // a neighbour, of its speed

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

int LevelOf(const SpeedPoint& p, const SpeedOptions& o) {
  return static_cast<int>(std::lround(p.safe_m_per_s / StepOf(o)));
}

}  // namespace

/// What a planner asks of the points of a path: speeds by levels.
class SpeedPlanner::Question final : public PathQuestion {
 public:
  /// Level l: speed l step.
  Question(const SpeedPlanner& planner, const SpeedOptions& options, double step)
      : planner_(planner), options_(options), step_(step) {}

  Motion MotionAt(const PathPoint& p, int level) const override {
    return SpeedPlanner::MotionAt(p, options_, step_ * level, 0);
  }
  double Slack(const Solution& s) const override { return planner_.Slack(s, options_); }
  double Shortfall(const Solution& s) const override { return planner_.ShortfallOf(s, options_); }
  Binding BindingOf(const Motion& m, const Solution& s) const override {
    return planner_.BindingOf(m, s, options_);
  }

 private:
  const SpeedPlanner& planner_;
  const SpeedOptions& options_;
  double step_;
};

/// Points that are searched once more, each from a point that is driven faster.
class SpeedPlanner::Raising final : public LevelSearch::Items {
 public:
  Raising(SpeedPlanner* planner, std::span<const PathPoint> path, const SpeedOptions& options,
          std::size_t count, std::span<SpeedPoint> out)
      : planner_(*planner), path_(path), options_(options), count_(count), out_(out) {}

  bool Begin(LevelSearch::Track* t) override {
    if (next_ == count_) return false;
    t->item = next_++;
    const std::size_t from = planner_.higher_[t->item], at = planner_.knots_[t->item];
    const double most =
        from == at ? LevelOf(out_[at], options_) / (1 - kFarBelow) : LevelOf(out_[from], options_);
    LevelSearch::BeginAt(std::min<int>(kSpeedLevels, std::ceil(most)), planner_.solutions_[from],
                         t);
    if (out_[at].safe_m_per_s > 0) t->low = LevelOf(out_[at], options_);
    return true;
  }
  Motion MotionAt(std::size_t k, int level) const override {
    return SpeedPlanner::MotionAt(path_[planner_.knots_[k]], options_, StepOf(options_) * level, 0);
  }
  double Slack(const Solution& s) const override { return planner_.Slack(s, options_); }
  double Shortfall(const Solution& s) const override { return planner_.ShortfallOf(s, options_); }
  void Found(const LevelSearch::Track& t) override {
    if (!t.here) return;  // none above the one that was known
    const std::size_t i = planner_.knots_[t.item];
    out_[i].safe_m_per_s = StepOf(options_) * t.low;
    out_[i].safe_binding = t.low == kSpeedLevels
                               ? Binding::kSpeedLimit
                               : planner_.BindingOf(t.failed.motion, t.failed.solution, options_);
    out_[i].shortfall = t.shortfall;
    planner_.solutions_[i] = t.good;
    planner_.risen_[i] = true;
  }

 private:
  SpeedPlanner& planner_;
  std::span<const PathPoint> path_;
  const SpeedOptions& options_;
  std::size_t count_, next_ = 0;
  std::span<SpeedPoint> out_;
};

// The solution at the safe speed stays in solutions_.
void SpeedPlanner::Safe(std::span<const PathPoint> path, const SpeedOptions& o,
                        std::span<SpeedPoint> out) {
  path_search_.Run(&search_, &solver_, path, kSpeedLevels, kSpacing, Question(*this, o, StepOf(o)),
                   solutions_, tried_);
  const std::span<const PathSearch::Node> nodes = path_search_.nodes();
  for (std::size_t i = 0; i < path.size(); ++i) {
    out[i].safe_m_per_s = StepOf(o) * std::max(0, nodes[i].level);
    out[i].safe_binding = nodes[i].binding;
    out[i].shortfall = nodes[i].shortfall;
  }
  Raise(path, o, out);
}

// Points far below a neighbour are searched once more, from its speed and its solution down; those
// that rise may raise their neighbours, so that runs fill from both ends. Points that stay are from
// as far above themselves.
void SpeedPlanner::Raise(std::span<const PathPoint> path, const SpeedOptions& o,
                         std::span<SpeedPoint> out) {
  std::fill(risen_.begin(), risen_.end(), true);
  for (std::size_t low = Low(path, out); low > 0; low = Low(path, out)) {
    Raising raising(this, path, o, low, out);
    search_.Run(&solver_, kSpeedLevels, &raising);
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

}  // namespace grouser::vehicle
