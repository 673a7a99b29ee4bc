#include "surrogate/vehicle/speed_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace grouser::vehicle {
namespace {

constexpr double kResolution = 1.0 / 256;  // of the safe speed, over the limit
constexpr int kMostVerifications = 100;
constexpr std::size_t kAlike = 8;  // points after one that bear no more acceleration
constexpr int kPatience = 4;       // failures before an accelerating point is driven slower

// Where the plan does not hold: shares of speed and acceleration that are left, by how many times
// the point failed; in the end it stands still.
struct Slowing {
  double speed, acceleration;
};
constexpr Slowing SlowingOf(int failures) {
  if (failures <= 6) return {0.96, 0.7};
  if (failures <= 16) return {0.8, 0.4};
  return {0, 0};
}

void CheckOptions(const SpeedOptions& o) {
  CheckMargins(o);
  Need(o.speed_limit_m_per_s > 0 && std::isfinite(o.speed_limit_m_per_s), "speed_limit_m_per_s",
       "a finite number above 0");
  Need(o.acceleration_m_per_s2 > 0 && o.braking_m_per_s2 > 0, "acceleration, braking",
       "numbers above 0");
  Need(o.start_m_per_s >= 0 && o.end_m_per_s >= 0, "start, end", "speeds from 0 on");
}

}  // namespace

SpeedPlanner::SpeedPlanner(const Vehicle& vehicle, const Grounds& grounds, std::size_t most)
    : vehicle_(vehicle),
      soils_(grounds.soils.size()),
      solver_(vehicle, grounds),
      motions_(most),
      solutions_(most),
      tried_(most),
      path_search_(most),
      reached_(4 * most),
      open_(most),
      knots_(most),
      higher_(most),
      risen_(most),
      cap_(most),
      faster_(most),
      slower_(most),
      faster_share_(most),
      slower_share_(most),
      most_faster_(most),
      tried_speed_(most),
      tried_acceleration_(most),
      failures_(most),
      slowed_by_(most) {}

// Solves the first motions, each from what stands in solutions_ or, if that is of another speed,
// from that of the point before where that is one of them and good; and anew where that finds
// nothing that is good: with two starts, at every fourth failure of a point with all.
class SpeedPlanner::Tries final : public SolveSource {
 public:
  Tries(SpeedPlanner* planner, std::size_t count, const SpeedOptions& options)
      : planner_(*planner), options_(options), count_(count) {}

  // To each lane some motions in a block.
  bool Next(std::size_t lane, Task* task) override {
    constexpr Effort kQuick{.warm = true,
                            .attempts = 1,
                            .evaluations = 12,
                            .goal = Solution::kTolerance,
                            .brief = true};
    constexpr Effort kSome{
        .attempts = 2, .evaluations = 16, .goal = Solution::kTolerance, .brief = true};
    constexpr Effort kAll{.goal = Solution::kTolerance, .brief = true};
    Block& block = blocks_[lane];
    if (block.anew) {
      const int failures = planner_.failures_[planner_.open_[block.at]];
      *task = {&planner_.motions_[block.at], &planner_.tried_[block.at],
               failures % kOften == kOften - 1 ? kAll : kSome};
      return true;
    }
    if (block.next == block.end) {
      if (next_ == count_) return false;
      block = {.next = next_, .end = std::min(next_ + kBlock, count_)};
      next_ = block.end;
    }
    const std::size_t k = block.next++, i = planner_.open_[k];
    const Motion& motion = planner_.motions_[k];
    const double own = planner_.solutions_[i].v_x_m_per_s;
    const bool from_last = block.good && planner_.open_[k - 1] + 1 == i &&
                           motion.soil[0] == planner_.motions_[k - 1].soil[0] &&
                           std::fabs(own - motion.v_x_m_per_s) > kNear * motion.v_x_m_per_s;
    planner_.tried_[k] = from_last ? planner_.tried_[k - 1] : planner_.solutions_[i];
    block.at = k;
    *task = {&planner_.motions_[k], &planner_.tried_[k], kQuick};
    return true;
  }
  void Done(std::size_t lane) override {
    Block& block = blocks_[lane];
    block.good = planner_.Good(planner_.tried_[block.at], options_);
    block.anew = !block.anew && !block.good;
  }

 private:
  static constexpr int kOften = 4;
  static constexpr double kNear = 0.02;  // of the speed: a solution that is better than another's
  static constexpr std::size_t kBlock = 8;
  struct Block {
    std::size_t next = 0, end = 0, at = 0;
    bool good = false, anew = false;
  };
  SpeedPlanner& planner_;
  const SpeedOptions& options_;
  std::size_t count_, next_ = 0;
  std::array<Block, Solver::kLanes> blocks_{};
};

// Solves the points whose speed or acceleration is new, slows those that do not hold. False: none
// was slowed.
bool SpeedPlanner::Verify(std::span<const PathPoint> path, const SpeedOptions& o,
                          std::span<SpeedPoint> out) {
  std::size_t open = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double v = out[i].speed_m_per_s, a = out[i].acceleration_m_per_s2;
    out[i].holds = out[i].holds && out[i].safe_m_per_s > 0;
    if (!(out[i].safe_m_per_s > 0) || (v == tried_speed_[i] && a == tried_acceleration_[i]))
      continue;
    tried_speed_[i] = v;
    tried_acceleration_[i] = a;
    if (v == out[i].safe_m_per_s && a == 0) {  // solved by the search
      out[i].holds = true;
      continue;
    }
    motions_[open] = MotionAt(path[i], o, v, a);
    open_[open++] = i;
  }
  Tries tries(this, open, o);
  StopIfAsked(o.stop);
  solver_.Solve(&tries);
  bool slowed = false;
  for (std::size_t k = 0; k < open; ++k) {
    const std::size_t i = open_[k];
    out[i].holds = Good(tried_[k], o);
    if (out[i].holds) solutions_[i] = tried_[k];
    if (out[i].holds) continue;
    if (out[i].speed_m_per_s == 0 && out[i].acceleration_m_per_s2 == 0) continue;  // no slower
    slowed = true;
    slowed_by_[i] = BindingOf(motions_[k], tried_[k], o);
    Slow(path, i, out);
  }
  return slowed;
}

// Point i bears less acceleration, and so do the points after it; where that does not help, of the
// two ends of its step the faster is too fast.
void SpeedPlanner::Slow(std::span<const PathPoint> path, std::size_t i,
                        std::span<const SpeedPoint> out) {
  const Slowing left = SlowingOf(++failures_[i]);
  const std::size_t last = out.size() - 1, step = std::min(i, last - 1);
  const bool accelerates = out[i].acceleration_m_per_s2 > 0;
  if (accelerates) {
    const double most = left.acceleration * out[i].acceleration_m_per_s2;
    for (std::size_t k = step; k < std::min(last, step + kAlike); ++k) {
      if (path[k].soil != path[i].soil) break;
      most_faster_[k] = std::min(most_faster_[k], most);
    }
    if (failures_[i] < kPatience) return;
  } else {
    slower_[step] *= left.acceleration;
  }
  cap_[i] = std::min(cap_[i], left.speed * out[i].speed_m_per_s);
  if (!accelerates || i == last) return;
  cap_[i + 1] = std::min(cap_[i + 1], left.speed * out[i + 1].speed_m_per_s);
  if (failures_[i + 1]++ == 0) slowed_by_[i + 1] = slowed_by_[i];
}

bool SpeedPlanner::Moves(std::span<const SpeedPoint> plan, std::size_t i) {
  return i + 1 == plan.size() || plan[i].speed_m_per_s + plan[i + 1].speed_m_per_s > 0;
}

// What stands still up to the next point is not driven, nor is a start that is faster than what the
// path ahead allows.
bool SpeedPlanner::MayHold(const SpeedOptions& o, std::span<const SpeedPoint> plan, std::size_t i) {
  const double slower = o.start_m_per_s - plan[i].speed_m_per_s;
  if (i == 0 && slower > kResolution * o.speed_limit_m_per_s) return false;
  return plan[i].safe_m_per_s > 0 && Moves(plan, i);
}

// Points that do not hold.
std::size_t SpeedPlanner::NotHeld(const SpeedOptions& o, std::span<SpeedPoint> out) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i].holds = out[i].holds && MayHold(o, out, i);
    count += !out[i].holds;
  }
  return count;
}

void SpeedPlanner::CheckPath(std::span<const PathPoint> path, const SpeedOptions& options,
                             std::size_t answers) const {
  const auto fail = [](std::size_t i, const std::string& what) {
    throw std::invalid_argument("path point " + std::to_string(i) + ": " + what);
  };
  if (path.size() < 2 || path.size() > motions_.size() || answers != path.size()) {
    throw std::invalid_argument("path: got " + std::to_string(path.size()) +
                                " points, expected 2 to " + std::to_string(motions_.size()) +
                                " and as many answers");
  }
  CheckOptions(options);
  for (std::size_t i = 0; i < path.size(); ++i) {
    const PathPoint& p = path[i];
    for (const double x : {p.s_m, p.curvature_per_m, p.grade_rad, p.bank_rad}) {
      if (!std::isfinite(x)) fail(i, "got a number that is not finite");
    }
    if (i > 0 && !(p.s_m > path[i - 1].s_m)) {
      fail(i, "s_m: got " + std::to_string(p.s_m) + ", expected more than that before");
    }
    if (p.soil >= soils_) fail(i, "soil: expected one of the vehicle file");
  }
}

std::size_t SpeedPlanner::Plan(std::span<const PathPoint> path, const SpeedOptions& options,
                               std::span<SpeedPoint> out) {
  CheckPath(path, options, out.size());
  Safe(path, options, out);
  Reach(path, options, out);
  for (std::size_t i = 0; i < path.size(); ++i) {
    cap_[i] = out[i].safe_m_per_s;
    failures_[i] = 0;
    tried_speed_[i] = -1;
  }
  for (int round = 0; round < kMostVerifications; ++round) {
    Passes(path, options, out);
    if (!Verify(path, options, out)) break;
  }
  return NotHeld(options, out);
}

}  // namespace grouser::vehicle
