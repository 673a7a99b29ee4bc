#include "surrogate/vehicle/path_search.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace grouser::vehicle {
namespace {

// Inputs off the parabola: of the weight; of what is asked for in the middle.
constexpr double kStraight = 1e-3, kStraightShare = 5e-3, kStraightAtMost = 5e-3;
constexpr double kSteep = 6;  // levels from a point to the next
constexpr double kBend = 2;   // levels by which the middle may lie off the chord
// Force over weight above which nothing balances, by the most at which anything did on that soil.
constexpr double kHeldShare = 1.1, kHeldMore = 0.003, kMissedShare = 1.05;

/// Weights of three points in the parabola through them, at s.
std::array<double, 3> Parabola(double a, double m, double b, double s) {
  return {(s - m) * (s - b) / ((a - m) * (a - b)), (s - a) * (s - b) / ((m - a) * (m - b)),
          (s - a) * (s - m) / ((b - a) * (b - m))};
}

/// What a warm solve reads of a solution, as sum of weights times solutions.
template <std::size_t kCount>
void Blend(const std::array<const Solution*, kCount>& from,
           const std::array<double, kCount>& weight, Solution* to) {
  const auto sum = [&](auto&& number) {
    double x = 0;
    for (std::size_t k = 0; k < kCount; ++k) x += weight[k] * number(*from[k]);
    return x;
  };
  to->balanced = true;
  to->given = Motion::Given::kTwist;
  to->v_x_m_per_s = sum([](const Solution& s) { return s.v_x_m_per_s; });
  to->v_y_m_per_s = sum([](const Solution& s) { return s.v_y_m_per_s; });
  to->yaw_rate_rad_per_s = sum([](const Solution& s) { return s.yaw_rate_rad_per_s; });
  to->steering_rad = sum([](const Solution& s) { return s.steering_rad; });
  to->pitching_moment_n_m = sum([](const Solution& s) { return s.pitching_moment_n_m; });
  for (std::size_t d = 0; d < kMostDrives; ++d) {
    to->rim_speed_m_per_s[d] = sum([d](const Solution& s) { return s.rim_speed_m_per_s[d]; });
  }
  for (std::size_t i = 0; i < kMostWheels; ++i) {
    to->wheel[i].rim_speed_m_per_s =
        sum([i](const Solution& s) { return s.wheel[i].rim_speed_m_per_s; });
  }
  for (std::size_t i = 0; i < to->interval_slope.size(); ++i) {
    for (std::size_t k = 0; k < to->interval_slope.size(); ++k) {
      to->interval_slope[i][k] = static_cast<float>(
          sum([&](const Solution& s) { return double{s.interval_slope[i][k]}; }));
    }
  }
}

}  // namespace

PathSearch::PathSearch(std::size_t most)
    : nodes_(most), places_(most), full_(most), quick_(most), none_(most) {}

void PathSearch::Run(LevelSearch* search, Solver* solver, std::span<const PathPoint> path,
                     int levels, std::size_t spacing, const PathQuestion& question,
                     std::span<Solution> good, std::span<Solution> failed) {
  path_ = path;
  good_ = good;
  failed_ = failed;
  question_ = &question;
  levels_ = levels;
  half_length_ = HalfLengthOf(solver->vehicle());
  gravity_ = solver->vehicle().gravity_m_per_s2;
  grip_.fill(0);
  held_.fill({});
  full_begin_ = full_end_ = quick_begin_ = quick_end_ = none_begin_ = none_end_ = 0;
  Lay(spacing);
  search->Run(solver, levels, this);
}

// The points that are searched from nothing: both ends of every stretch that goes on, and some
// between; of a stretch of equal points the first.
void PathSearch::Lay(std::size_t spacing) {
  const std::size_t n = path_.size();
  for (std::size_t i = 0; i < n; ++i) {
    nodes_[i] = Node{};
    places_[i] = Place{.left = i, .right = i};
  }
  for (std::size_t first = 0, end = 0; first < n; first = end) {
    end = first + 1;
    while (end < n && path_[end].soil == path_[first].soil) ++end;
    const std::size_t last = end - 1, gaps = (last - first + spacing - 1) / spacing;
    Push(first);
    if (Equal(first, last)) {
      places_[first].right = last;
      places_[first].run = true;
      continue;
    }
    std::size_t before = first;
    for (std::size_t k = 1; k <= gaps; ++k) {
      const std::size_t knot = first + (last - first) * k / gaps;
      Push(knot);
      places_[before].right = knot;
      places_[knot].left = before;
      before = knot;
    }
  }
}

void PathSearch::Push(std::size_t i) { full_[full_end_++] = i; }

// The next point: those on which others rest first.
bool PathSearch::Pop(std::size_t* i) {
  if (full_begin_ < full_end_) {
    *i = full_[full_begin_++];
    return true;
  }
  if (quick_begin_ < quick_end_) {
    *i = quick_[quick_begin_++];
    return true;
  }
  while (none_begin_ < none_end_) {
    *i = none_[none_begin_++];
    if (MayHold(*i, 0) || MayHold(*i, levels_)) return true;
  }
  return false;
}

bool PathSearch::Begin(LevelSearch::Track* t) {
  std::size_t i = 0;
  if (!Pop(&i)) return false;
  t->item = i;
  const Place& p = places_[i];
  if (p.quick) {
    OnParabola(p, i, t);
  } else if (p.between) {
    Between(p.left, p.right, i, t);
  }
  return true;
}

// The failure beyond a point's level, of itself or of the one it was taken from.
void PathSearch::Recall(std::size_t from, LevelSearch::Track* t) const {
  const Node& n = nodes_[nodes_[from].failure];
  const std::size_t at = nodes_[from].failure;
  if (n.failed_level == LevelSearch::kNone) return;
  const auto fill = [&](int level, const Solution& s, int k, LevelSearch::Failure* f) {
    f->motion = MotionAt(at, level);
    f->solution = s;
    f->slack = n.failed_slack;
    f->level = level;
    f->asked = MotionAt(n.asked[k], level);
    f->asked_item = n.asked[k];
    f->least = n.least[k];
  };
  fill(n.failed_level, failed_[at], 0, &t->failed);
  if (n.level >= 0) return;
  t->lowest = t->failed;
  if (n.least[1] >= 0) fill(levels_, good_[at], 1, &t->highest);
}

// What a and b let expect of a point between them.
void PathSearch::Between(std::size_t a, std::size_t b, std::size_t i, LevelSearch::Track* t) const {
  const Node &p = nodes_[a], &q = nodes_[b];
  const double share = (path_[i].s_m - path_[a].s_m) / (path_[b].s_m - path_[a].s_m);
  const std::size_t near = share < 0.5 ? a : b;
  if (p.level < 0 && q.level < 0) {
    t->suggested = -1;
    t->hopeless[0] = !MayHold(i, 0);
    t->hopeless[1] = !MayHold(i, levels_);
    Recall(near, t);
    return;
  }
  if (p.level < 0 || q.level < 0) {
    const std::size_t from = p.level < 0 ? b : a;
    t->suggested = nodes_[from].level;
    t->good = good_[from];
    Recall(from, t);
    return;
  }
  t->suggested = Expected(a, b, i, share);
  t->wary = Steep(a, b);
  Blend<2>({&good_[a], &good_[b]}, {1 - share, share}, &t->good);
  const std::size_t of = nodes_[near].level < levels_ ? near : near == a ? b : a;
  if (p.binding == q.binding && p.slope < 0 && q.slope < 0) {
    t->slope = std::lerp(p.slope, q.slope, share);
  }
  Recall(of, t);
}

// The level that a and b let expect between them: where grip ends it, that at which no more force
// along the ground is asked for than there; else on the chord.
int PathSearch::Expected(std::size_t a, std::size_t b, std::size_t i, double share) const {
  const auto grip = [&](std::size_t k) {
    const Binding limit = nodes_[k].binding;
    return limit == Binding::kLateralGrip || limit == Binding::kTraction ||
           limit == Binding::kRollover;
  };
  const auto all = [&](std::size_t k) { return nodes_[k].level == levels_; };
  const int level =
      std::clamp(static_cast<int>(std::lerp(nodes_[a].edge, nodes_[b].edge, share)), 0, levels_);
  double most = 0;
  if (grip(a) && grip(b)) {
    most = std::lerp(ForceRatio(a, nodes_[a].level), ForceRatio(b, nodes_[b].level), share);
  } else if ((grip(a) || all(a)) && (grip(b) || all(b))) {
    most = grip_[path_[i].soil];  // of the last that was found on that soil
  } else {
    return level;
  }
  if (!(most > 0) || ForceRatio(i, levels_) <= most) return all(a) && all(b) ? levels_ : level;
  int low = 0, high = levels_;
  while (high > low + 1) {
    const int middle = (low + high) / 2;
    (ForceRatio(i, middle) <= most ? low : high) = middle;
  }
  return low;
}

// The force along the ground that gravity and inertia ask for, over the weight.
double PathSearch::ForceRatio(std::size_t i, int level) const {
  const Motion m = MotionAt(i, level);
  return std::hypot(m.acceleration_m_per_s2 / gravity_ + std::sin(m.grade_rad),
                    m.v_x_m_per_s * m.yaw_rate_rad_per_s / gravity_ + std::sin(m.bank_rad));
}

void PathSearch::OnParabola(const Place& p, std::size_t i, LevelSearch::Track* t) const {
  const auto weight =
      Parabola(path_[p.left].s_m, path_[p.middle].s_m, path_[p.right].s_m, path_[i].s_m);
  const double level = weight[0] * nodes_[p.left].edge + weight[1] * nodes_[p.middle].edge +
                       weight[2] * nodes_[p.right].edge;
  t->quick = true;
  constexpr double kRounding = 1e-6;  // the weights add up to nearly 1
  t->suggested = std::clamp(static_cast<int>(level + kRounding), 0, levels_);
  Blend<3>({&good_[p.left], &good_[p.middle], &good_[p.right]}, weight, &t->good);
  t->slope = nodes_[p.middle].slope;
  Recall(p.middle, t);
}

void PathSearch::Found(const LevelSearch::Track& t) {
  const std::size_t i = t.item;
  Keep(t);
  const Place& p = places_[i];
  if (p.quick) return;
  if (p.between) {
    if (!p.alone) CheckMiddle(i);
    return;
  }
  if (p.run) {
    for (std::size_t j = i + 1; j <= p.right; ++j) Copy(i, j);
    return;
  }
  if (p.right > i && nodes_[p.right].known) Split(i, p.right);
  if (p.left < i && nodes_[p.left].known) Split(p.left, i);
}

// What was found, for those who asked and for the neighbours.
void PathSearch::Keep(const LevelSearch::Track& t) {
  const std::size_t i = t.item;
  Node& n = nodes_[i];
  const Place& p = places_[i];
  const bool taken = p.quick && !t.failed_here;
  n.known = true;
  n.level = t.low;
  n.slope = t.slope;
  n.shortfall = t.shortfall;
  n.binding = t.low == levels_ ? Binding::kSpeedLimit
              : taken          ? nodes_[p.middle].binding
                               : question_->BindingOf(t.failed.motion, t.failed.solution);
  if (taken && t.low < levels_ && !(t.slope < 0)) n.shortfall = nodes_[p.middle].shortfall;
  const double fall = t.failed_here ? t.slack - t.failed.slack : -t.slope;
  const double part = fall > 0 ? std::clamp(t.slack / fall, 0.0, 1.0) : 0.5;
  Learn(t);
  n.edge = t.low == levels_ || t.low < 0 ? t.low : t.low + part;
  if (t.low >= 0) good_[i] = t.good;
  n.failure = i;
  n.failed_level = LevelSearch::kNone;
  if (taken || t.low == levels_ || t.failed.level == LevelSearch::kNone) return;
  n.failed_level = t.failed.level;
  n.failed_slack = t.failed.slack;
  n.asked[0] = t.failed.asked_item;
  n.least[0] = t.failed.least;
  failed_[i] = t.failed.solution;
  n.least[1] = -1;
  if (t.low >= 0 || t.highest.level == LevelSearch::kNone) return;
  n.asked[1] = t.highest.asked_item;
  n.least[1] = t.highest.least;
  good_[i] = t.highest.solution;
}

// What force along the ground balances on a soil.
void PathSearch::Learn(const LevelSearch::Track& t) {
  const std::size_t soil = path_[t.item].soil, i = t.item;
  const Binding limit = nodes_[i].binding;
  if (t.low >= 0) {
    const double force = ForceRatio(i, t.low);
    double& most = held_[soil][Pulls(i, t.low)].balanced;
    most = std::max(most, force);
    if (limit == Binding::kLateralGrip || limit == Binding::kTraction) grip_[soil] = force;
    return;
  }
  for (const LevelSearch::Failure* f : {&t.failed, &t.highest}) {
    if (f->level == LevelSearch::kNone || !(f->solution.residual >= 0)) continue;
    double& most = held_[soil][Pulls(i, f->level)].missed;
    most = std::max(most, ForceRatio(i, f->level) - f->solution.residual);
  }
}

void PathSearch::Copy(std::size_t from, std::size_t to) {
  nodes_[to] = nodes_[from];
  if (nodes_[from].level >= 0) good_[to] = good_[from];
}

bool PathSearch::Equal(std::size_t a, std::size_t b) const {
  const PathPoint& p = path_[a];
  for (std::size_t i = a + 1; i <= b; ++i) {
    const PathPoint& q = path_[i];
    if (q.curvature_per_m != p.curvature_per_m || q.grade_rad != p.grade_rad ||
        q.bank_rad != p.bank_rad) {
      return false;
    }
  }
  return true;
}

// The points between two that are known.
void PathSearch::Split(std::size_t a, std::size_t b) {
  if (b < a + 2) return;
  if (Equal(a, b)) {
    for (std::size_t i = a + 1; i < b; ++i) Copy(a, i);
    return;
  }
  const std::size_t m = (a + b) / 2;
  places_[m] = {.left = a, .middle = m, .right = b, .between = true};
  Push(m);
}

// Whether the middle is what both sides let expect.
void PathSearch::CheckMiddle(std::size_t m) {
  const std::size_t a = places_[m].left, b = places_[m].right;
  if (nodes_[a].level < 0 && nodes_[m].level < 0 && nodes_[b].level < 0) {
    FillNone(a, m, b);
  } else if (Alike(a, m, b) && Smooth(a, m, b)) {
    Fill(a, m, b);
  } else {
    Split(a, m);
    Split(m, b);
  }
}

bool PathSearch::Alike(std::size_t a, std::size_t m, std::size_t b) const {
  const Node &p = nodes_[a], &q = nodes_[m], &r = nodes_[b];
  if (p.level < 0 || q.level < 0 || r.level < 0) return false;
  if (p.binding != q.binding || r.binding != q.binding) return false;
  if (q.level == levels_) return true;
  for (std::size_t i = a + 1; i <= b; ++i) {  // where a curve begins to turn the other way: a cusp
    if (path_[i].curvature_per_m * path_[a].curvature_per_m < 0) return false;
  }
  const double share = (path_[m].s_m - path_[a].s_m) / (path_[b].s_m - path_[a].s_m);
  return std::fabs(std::lerp(p.edge, r.edge, share) - q.edge) <= kBend && !Steep(a, b);
}

bool PathSearch::Steep(std::size_t a, std::size_t b) const {
  return std::fabs(nodes_[a].edge - nodes_[b].edge) > kSteep * static_cast<double>(b - a);
}

// Whether what the points between ask for is on the parabolas.
bool PathSearch::Smooth(std::size_t a, std::size_t m, std::size_t b) const {
  const double v = MotionAt(m, nodes_[m].level).v_x_m_per_s;
  const double by_curvature = v * v / gravity_ + half_length_;
  const double most = nodes_[m].level == levels_
                          ? kStraightAtMost
                          : std::max(kStraight, kStraightShare * ForceRatio(m, nodes_[m].level));
  for (std::size_t i = a + 1; i < b; ++i) {
    if (i == m) continue;
    const auto w = Parabola(path_[a].s_m, path_[m].s_m, path_[b].s_m, path_[i].s_m);
    const auto off = [&](double PathPoint::*x) {
      return std::fabs(w[0] * (path_[a].*x) + w[1] * (path_[m].*x) + w[2] * (path_[b].*x) -
                       path_[i].*x);
    };
    const double change = off(&PathPoint::grade_rad) + off(&PathPoint::bank_rad) +
                          by_curvature * off(&PathPoint::curvature_per_m);
    if (!(change <= most)) return false;
  }
  return true;
}

// Points between three at which nothing is good: nothing is, but where no more force is asked for
// than has balanced. That is looked at when all others are known.
void PathSearch::FillNone(std::size_t a, std::size_t m, std::size_t b) {
  const Node& middle = nodes_[m];
  for (std::size_t i = a + 1; i < b; ++i) {
    if (i == m) continue;
    places_[i] = {.left = a, .middle = m, .right = b, .between = true, .alone = true};
    nodes_[i] = middle;
    nodes_[i].binding = question_->BindingOf(MotionAt(i, nodes_[middle.failure].failed_level),
                                             failed_[middle.failure]);
    none_[none_end_++] = i;
  }
}

// Whether a level asks for little more than has balanced on that soil, if for more.
bool PathSearch::MayHold(std::size_t i, int level) const {
  const Held& held = held_[path_[i].soil][Pulls(i, level)];
  if (held.balanced == 0 && held.missed == 0) return true;  // nothing is known of it
  return ForceRatio(i, level) <=
         std::max(kHeldShare * held.balanced + kHeldMore, kMissedShare * held.missed);
}

bool PathSearch::Pulls(std::size_t i, int level) const {
  const Motion m = MotionAt(i, level);
  return m.acceleration_m_per_s2 / gravity_ + std::sin(m.grade_rad) > 0;
}

// Points that lie on the parabola through three that are known.
void PathSearch::Fill(std::size_t a, std::size_t m, std::size_t b) {
  const Node& middle = nodes_[m];
  for (std::size_t i = a + 1; i < b; ++i) {
    if (i == m) continue;
    places_[i] = {.left = a, .middle = m, .right = b, .quick = true};
    quick_[quick_end_++] = i;
  }
}

}  // namespace grouser::vehicle
