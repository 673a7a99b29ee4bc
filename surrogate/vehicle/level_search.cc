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
constexpr int kExpected = 1;     // levels around the suggested one that are no surprise
constexpr int kMostChange = 16;  // levels that are followed at once
constexpr double kRemote = 0.5;  // of the least imbalance: changes that cannot make up for it
constexpr double kDoubt = 2;     // of the imbalance beyond the limit at the neighbour
constexpr double kOpen = 0.12;   // of a level: loss by a wrong failure that is worth more solves
constexpr double kClear = 0.75;  // of a level: a limit nearer than that is not taken for the next
constexpr double kAmple = 1;     // levels of slack that a suggested one may leave
constexpr double kMostSlope = 0.05;  // of the slack in a level; more is another balance

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

// Nothing is known of an item.
void LevelSearch::Clear(Track* t) {
  t->suggested = kNone;
  t->slack = NAN;
  t->slope = 0;
  t->low = -1;
  t->stride = 0;
  t->quick = t->light = t->wary = t->hopeless[0] = t->hopeless[1] = t->thorough = t->hard = false;
  t->wide = t->sure = t->goes_on = t->doubt = t->here = t->failed_here = false;
  t->failed.level = t->lowest.level = t->highest.level = kNone;
}

// The first level: where the neighbours point to.
void LevelSearch::Begin(Track* t) const {
  t->high = t->above = levels_ + 1;
  t->level = t->suggested < 0 ? levels_ : std::min(t->suggested, levels_);
  t->all_starts = t->suggested == kNone;
  t->near_failure = t->suggested == -1;
}

void LevelSearch::BeginAt(int level, const Solution& solution, Track* t) {
  t->suggested = level;
  t->good = solution;
  t->thorough = true;
}

double HalfLengthOf(const Vehicle& vehicle) {
  double longest = 0;
  for (const Wheel& a : vehicle.wheels) {
    for (const Wheel& b : vehicle.wheels) {
      longest = std::max(longest, std::hypot(a.x_m - b.x_m, a.y_m - b.y_m));
    }
  }
  return longest / 2;
}

void LevelSearch::SetScales(const Vehicle& vehicle) {
  gravity_ = vehicle.gravity_m_per_s2;
  length_ = HalfLengthOf(vehicle);
}

double ChangeOf(const Motion& a, const Motion& b, double half_length, double gravity) {
  const double across = b.v_x_m_per_s * b.yaw_rate_rad_per_s - a.v_x_m_per_s * a.yaw_rate_rad_per_s;
  const double along = b.acceleration_m_per_s2 - a.acceleration_m_per_s2;
  const double bend = b.yaw_rate_rad_per_s / b.v_x_m_per_s - a.yaw_rate_rad_per_s / a.v_x_m_per_s;
  return std::fabs(b.grade_rad - a.grade_rad) + std::fabs(b.bank_rad - a.bank_rad) +
         (std::fabs(across) + std::fabs(along)) / gravity + std::fabs(bend) * half_length;
}

// Whether the imbalance that was left is far more than what the motion has changed since can make
// up for.
bool LevelSearch::Remote(const Failure& f, const Motion& m) const {
  if (f.level == kNone || f.solution.balanced) return false;
  return ChangeOf(f.asked, m, length_, gravity_) < kRemote * f.least;
}

// Where none is good yet: near a failure only where nothing can have changed that.
void LevelSearch::Prepare(Track* t) const {
  if (!t->near_failure || t->low >= 0) return;
  const Failure& f = t->level > 0 ? t->highest : t->lowest;
  const bool near = t->hopeless[t->level > 0] || t->light;
  if (Remote(f, t->motion) || (near && f.level != kNone && !f.solution.balanced)) return;
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
    t->good = solution;
    t->here = true;
  } else {
    Fail(t, slack, solution);
  }
  if (t->failed_here && t->low >= 0 && t->high == t->low + 1) {  // both ends of the limit
    const double slope = t->failed.slack - t->slack;
    t->slope = slope < 0 && slope > -kMostSlope ? slope : 0;  // 0 also where it is not a number
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
    f->asked_item = t->item;
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
  return t.thorough && (!t.hard || t.level == 0) && t.failed_here && t.high == t.level &&
         Unbalanced(t.failed.solution) && t.above - std::max(t.low, 0) > kOpen * t.above;
}

// The next level to try; false: found.
bool LevelSearch::Next(Track* t) const {
  const bool all = t->all_starts, went_on = t->goes_on;
  t->all_starts = t->suggested == kNone;
  t->near_failure = t->goes_on = false;
  if (t->quick && t->here && t->level == t->suggested && !t->failed_here &&
      !(t->slope < 0 && t->slack > kAmple * -t->slope)) {
    return false;
  }
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
  if (t->thorough && t->failed_here && Unbalanced(t->failed.solution)) t->hard = true;
  if (t->doubt) {  // the same level in full
    t->doubt = false;
    return true;
  }
  if (t->low == levels_) return false;
  if (t->low >= 0 && t->high > levels_) return Up(t);
  if (t->high == t->low + 1) {
    const bool surprise =
        t->low < 0 ? t->suggested >= 0 : t->wary || std::abs(t->low - t->suggested) > kExpected;
    if (t->light && (t->low >= 0 || t->sure)) return false;
    if (t->low < 0 && t->sure && Unbalanced(t->failed.solution)) {
      t->level = 0;
      t->goes_on = true;
      return true;
    }
    // A fall of the slack like no limit's: the failure is of another balance.
    const bool jump = t->low >= 0 && t->slack - t->failed.slack > kMostSlope;
    if (t->sure || !(surprise || jump)) return false;
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
    if (left < kClear && !t->wary && !t->light && std::abs(t->low - t->suggested) <= kExpected) {
      t->high = t->low + 1;
      return false;
    }
    way = std::max(1, static_cast<int>(std::min<double>(left, kMostChange)));
  }
  if (way == 0) {
    way = Stride(t);
    t->near_failure =
        way == 1 && !t->all_starts && t->failed.level > 0 && !t->failed.solution.balanced;
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
  if (t->hard) {
    t->level = 0;
    return;
  }
  if (t->light && !(t->slope < 0)) {
    t->level = t->high / 2;
    return;
  }
  int way = 0;
  if (t->slope < 0 && t->failed.slack < 0) {
    way = static_cast<int>(std::min<double>(std::ceil(t->failed.slack / t->slope), kMostChange));
  }
  t->level = std::max(0, t->high - std::max(way, 1) * (way > 0 ? 1 : Stride(t)));
}

// To each lane an item at a time.
class LevelSearch::Source final : public SolveSource {
 public:
  Source(LevelSearch* search, Items* items) : search_(*search), items_(*items) {}

  bool Next(std::size_t lane, Task* task) override {
    Track& t = search_.tracks_[lane];
    if (!busy_[lane]) {
      Clear(&t);
      if (!items_.Begin(&t)) return false;
      search_.Begin(&t);
      busy_[lane] = true;
    }
    t.motion = items_.MotionAt(t.item, t.level);
    search_.Prepare(&t);
    Solution* solution = &search_.solutions_[lane];
    *task = {&t.motion, solution, Start(t, solution)};
    return true;
  }
  void Done(std::size_t lane) override {
    Track& t = search_.tracks_[lane];
    const Solution& solution = search_.solutions_[lane];
    search_.Settle(&t, items_.Slack(solution), solution);
    if (search_.Next(&t)) return;
    t.shortfall = t.low == search_.levels_ ? 0
                  : t.failed_here          ? items_.Shortfall(t.failed.solution)
                                           : -(t.slack + t.slope);
    busy_[lane] = false;
    items_.Found(t);
  }

 private:
  LevelSearch& search_;
  Items& items_;
  std::array<bool, kTracks> busy_{};
};

void LevelSearch::Run(Solver* solver, int levels, Items* items) {
  levels_ = levels;
  SetScales(solver->vehicle());
  for (Track& t : tracks_) t.good.balanced = false;
  Source source(this, items);
  solver->Solve(&source);
}

}  // namespace grouser::vehicle
