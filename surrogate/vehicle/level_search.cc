#include "surrogate/vehicle/level_search.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace grouser::vehicle {
namespace {

constexpr Effort kWithAllStarts{.brief = true};
constexpr Effort kFromNeighbour{
    .warm = true, .attempts = 2, .evaluations = 12, .goal = Solution::kTolerance, .brief = true};
constexpr Effort FromLeast(int evaluations) {
  return {.warm = true,
          .attempts = 1,
          .evaluations = evaluations,
          .goal = Solution::kTolerance,
          .brief = true,
          .from_least = true};
}
constexpr Effort kFromFailure = FromLeast(12), kGoingOn = FromLeast(200);
constexpr int kExpected = 1;      // levels around the suggested one that are no surprise
constexpr int kMostUnsolved = 8;  // items in a row whose limit is not asked in full
constexpr int kMostChange = 16;   // levels between items that are followed
constexpr double kClear = 0.75;   // of a level: a limit nearer than that is not taken for the next
constexpr double kRemote = 0.5;   // of the least imbalance: changes that cannot make up for it
constexpr double kDoubt = 2;      // of the imbalance beyond the limit at the items before
constexpr double kOpen = 0.12;    // of a level: loss by a wrong failure that is worth more solves
constexpr double kMostSlope = 0.05;  // of the slack in a level; more is another balance

// The last solution, moved on as from the one before to it, in proportion to the speed.
void MoveOn(const Solution& before, Solution* s) {
  if (!(before.v_x_m_per_s != 0)) return;
  const double ratio = s->v_x_m_per_s / before.v_x_m_per_s;
  const auto speed = [ratio](double* x, double last) { *x = 2 * *x - last * ratio; };
  speed(&s->v_y_m_per_s, before.v_y_m_per_s);
  for (std::size_t d = 0; d < kMostDrives; ++d) {
    speed(&s->rim_speed_m_per_s[d], before.rim_speed_m_per_s[d]);
  }
  for (std::size_t i = 0; i < kMostWheels; ++i) {
    speed(&s->wheel[i].rim_speed_m_per_s, before.wheel[i].rim_speed_m_per_s);
  }
  s->steering_rad = 2 * s->steering_rad - before.steering_rad;
  s->pitching_moment_n_m = 2 * s->pitching_moment_n_m - before.pitching_moment_n_m;
}

// Levels to go on by: 1, 1, 2, 4, ...
int Stride(LevelSearch::Track* t) {
  const int stride = std::max(1, t->stride);
  t->stride += stride;
  return stride;
}

// Whether more steps may balance it: neither tipped over nor outside of what the models know.
bool Unbalanced(const Solution& s) {
  return !s.balanced && (s.reasons & ~(kNoBalance | kOverTorque)) == 0;
}

}  // namespace

void LevelSearch::Forget(Track* t) {
  t->suggested = t->low_before = kNone;
  t->edge_before = kNone;
  t->slope = 0;
  t->two = false;
  t->failed.level = t->lowest.level = t->highest.level = kNone;
}

// The first level of an item: where those before it point to.
void LevelSearch::Begin(Track* t) const {
  if (t->suggested == -1 && t->unsolved >= kMostUnsolved) Forget(t);
  t->low = -1;
  t->high = levels_ + 1;
  t->stride = 0;
  t->level = t->suggested < 0 ? levels_ : std::min(t->suggested, levels_);
  t->all_starts = t->suggested == kNone;
  t->thorough = t->wide = t->sure = t->goes_on = t->doubt = t->here = t->failed_here = false;
  t->near_failure = t->suggested == -1;
}

void LevelSearch::BeginAt(int level, const Solution& solution, Track* t) {
  t->suggested = t->level = level;
  t->good = solution;
  t->slack = NAN;  // at a `low` that was known before
  t->all_starts = t->near_failure = false;
  t->thorough = true;
}

void LevelSearch::SetScales(const Vehicle& vehicle) {
  gravity_ = vehicle.gravity_m_per_s2;
  length_ = 0;
  for (const Wheel& a : vehicle.wheels) {
    for (const Wheel& b : vehicle.wheels) {
      length_ = std::max(length_, std::hypot(a.x_m - b.x_m, a.y_m - b.y_m) / 2);
    }
  }
}

// Whether the imbalance that was left is far more than what the motion has changed since can make
// up for: what gravity and inertia ask for over the weight, and the path of the wheels.
bool LevelSearch::Remote(const Failure& f, const Motion& m) const {
  if (f.level == kNone || f.solution.balanced) return false;
  const Motion& last = f.asked;
  const double across =
      m.v_x_m_per_s * m.yaw_rate_rad_per_s - last.v_x_m_per_s * last.yaw_rate_rad_per_s;
  const double along = m.acceleration_m_per_s2 - last.acceleration_m_per_s2;
  const double bend =
      m.yaw_rate_rad_per_s / m.v_x_m_per_s - last.yaw_rate_rad_per_s / last.v_x_m_per_s;
  const double change =
      std::fabs(m.grade_rad - last.grade_rad) + std::fabs(m.bank_rad - last.bank_rad) +
      (std::fabs(across) + std::fabs(along)) / gravity_ + std::fabs(bend) * length_;
  return change < kRemote * f.least;
}

// Where none is good yet: near a failure only where nothing can have changed that.
void LevelSearch::Prepare(Track* t) const {
  if (!t->near_failure || t->low >= 0) return;
  if (Remote(t->level > 0 ? t->highest : t->lowest, t->motion)) return;
  t->near_failure = false;
  t->all_starts = true;
}

// Where a solve begins, and how hard it tries.
Effort LevelSearch::Start(const Track& t, Solution* start) {
  if (t.goes_on) {
    *start = t.level > t.high ? t.highest.solution : t.failed.solution;
    return kGoingOn;
  }
  if (t.all_starts) return kWithAllStarts;
  if (t.near_failure) {
    *start = t.low >= 0 ? t.failed.solution : t.level > 0 ? t.highest.solution : t.lowest.solution;
    return kFromFailure;
  }
  *start = t.good;
  if (t.two && !t.here) MoveOn(t.before, start);
  return kFromNeighbour;
}

void LevelSearch::Settle(Track* t, double slack, const Solution& solution) const {
  if (slack >= 0) {
    if (t->level >= t->high) {  // it was not, from one start: all of them from here on
      t->high = levels_ + 1;
      t->stride = 0;
      if (!t->thorough) t->suggested = kNone;
      t->failed_here = false;
    }
    t->low = t->level;
    t->slack = slack;
    if (!t->here && t->good.balanced) {
      t->before = t->good;
      t->two = t->suggested >= 0;
    }
    t->good = solution;
    t->here = true;
  } else {
    Fail(t, slack, solution);
  }
  if (t->failed_here && t->low >= 0 && t->high == t->low + 1) {  // both ends of the limit
    const double slope = t->failed.slack - t->slack;
    t->slope = slope < 0 && slope > -kMostSlope ? slope : 0;  // 0 also where it is not a number
    t->unsolved = t->near_failure ? t->unsolved + 1 : 0;
  }
}

void LevelSearch::Fail(Track* t, double slack, const Solution& solution) const {
  if (t->level > t->high) return;  // the highest once more: level 0 stays what failed
  if (t->near_failure && t->low >= 0 && !(solution.residual < kDoubt * t->failed.least)) {
    t->doubt = true;
    return;
  }
  if (t->level < t->high) t->above = t->high;
  t->high = t->level;
  t->sure = t->all_starts || t->goes_on;
  t->failed_here = true;
  const auto keep = [&](Failure* f) {
    f->motion = t->motion;
    f->solution = solution;
    f->slack = slack;
    f->level = t->level;
    if (t->near_failure) return;
    f->asked = t->motion;
    f->least = solution.residual;
  };
  keep(&t->failed);
  if (t->level == 0) keep(&t->lowest);
  if (t->level == levels_ && t->suggested < 0) {
    keep(&t->highest);
    t->wide = !t->near_failure && Unbalanced(solution);
  }
}

// Whether the level that failed last is to be tried harder: much is lost if it is good.
bool LevelSearch::Open(const Track& t) {
  return t.thorough && t.failed_here && t.high == t.level && Unbalanced(t.failed.solution) &&
         t.above - std::max(t.low, 0) > kOpen * t.above;
}

// The next level to try; false: found.
bool LevelSearch::Next(Track* t) const {
  const bool all = t->all_starts, went_on = t->goes_on;
  t->all_starts = t->suggested == kNone;
  t->near_failure = t->goes_on = false;
  if (t->level > t->high) return false;          // the highest, the last that was left
  if (went_on && t->low < 0 && t->level == 0) {  // none below the highest, which is still to ask
    t->goes_on = t->wide;
    t->all_starts = !t->wide && t->suggested >= 0;
    t->level = levels_;
    return t->goes_on || t->all_starts;
  }
  if (!went_on && Open(*t)) {
    t->all_starts = !all;
    t->goes_on = all;
    return true;
  }
  if (t->doubt) {  // the same level in full
    t->doubt = false;
    return true;
  }
  if (t->low == levels_) return false;
  if (t->low >= 0 && t->high > levels_) return Up(t);
  if (t->high == t->low + 1) {
    const bool surprise =
        t->low < 0 ? t->suggested >= 0 : std::abs(t->low - t->suggested) > kExpected;
    if (t->low < 0 && t->sure && Unbalanced(t->failed.solution)) {
      t->level = 0;
      t->goes_on = true;
      return true;
    }
    if (t->sure || !surprise) return false;
    t->level = t->high;
    t->all_starts = true;
    return true;
  }
  if (t->low < 0) {
    Down(t);
    return true;
  }
  if (t->thorough && !t->here && t->failed.slack < 0) {  // by a margin: on from the neighbour
    t->level = std::max(t->low + 1, t->high - Stride(t));
    return true;
  }
  t->level = (t->low + t->high) / 2;
  const double fall = t->slack - t->failed.slack;
  if (fall > 0) {
    const double at = t->low + t->slack / fall * (t->high - t->low);
    t->level = std::clamp(static_cast<int>(at), t->low + 1, t->high - 1);
  }
  return true;
}

// None has failed yet.
bool LevelSearch::Up(Track* t) const {
  int way = 0;
  if (t->slope < 0) {
    const double left = t->slack / -t->slope;
    if (left < kClear && t->unsolved < kMostUnsolved &&
        std::abs(t->low - t->suggested) <= kExpected) {
      t->high = t->low + 1;
      ++t->unsolved;
      return false;
    }
    way = std::max(1, static_cast<int>(std::min<double>(left, kMostChange)));
  }
  if (way == 0) {
    way = Stride(t);
    t->near_failure = way == 1 && !t->all_starts && t->failed.level > 0 &&
                      !t->failed.solution.balanced && t->unsolved < kMostUnsolved;
  }
  t->level = std::min(levels_, t->low + way);
  return true;
}

// None is good yet.
void LevelSearch::Down(Track* t) const {
  if (t->suggested < 0) {
    t->level = 0;
    t->near_failure = !t->all_starts;  // see Prepare
    return;
  }
  int way = 0;
  if (t->slope < 0 && t->failed.slack < 0) {
    way = static_cast<int>(std::min<double>(std::ceil(t->failed.slack / t->slope), kMostChange));
  }
  t->level = std::max(0, t->high - std::max(way, 1) * (way > 0 ? 1 : Stride(t)));
}

// What an item suggests to the next: its level, moved on as from the one before it.
void LevelSearch::Follow(Track* t) const {
  const double edge = t->low >= 0 && t->slope < 0 ? t->low + t->slack / -t->slope : kNone;
  const int change = t->low_before >= 0 && t->low >= 0 ? t->low - t->low_before : 0;
  t->suggested = t->low;
  if (t->low >= 0 && t->low < levels_ && std::abs(change) <= kMostChange) {
    const double next = edge >= 0 && t->edge_before >= 0 ? 2 * edge - t->edge_before
                                                         : static_cast<double>(t->low + change);
    t->suggested = static_cast<int>(std::clamp<double>(next, 0, levels_));
  }
  if (t->low < 0) t->unsolved = t->sure ? 0 : t->unsolved + 1;
  t->low_before = t->low;
  t->edge_before = edge;
}

}  // namespace grouser::vehicle
