// What a vehicle can accelerate and brake along a path, and the passes over that.
#include <algorithm>
#include <cmath>

#include "surrogate/vehicle/speed_plan.h"

namespace grouser::vehicle {
namespace {

constexpr int kReachLevels = 32;     // of acceleration and braking
constexpr std::size_t kStride = 32;  // points between those whose reach is searched
constexpr double kSample = 0.75;     // of the safe speed: where the reach is searched besides rest
constexpr double kLeastShare = 0.05, kMostShare = 0.98, kLess = 0.9;

// The share of what holds at rest that is left at x = v/v_safe, from the share r at kSample: 0 at
// the safe speed where that is what ends it, by
//   sqrt(1 - x^q), q <= 4, for grip (4: an ellipse in speed^2), kLess (1 - x^q) otherwise;
// else the line through 1 and r.
double Left(const SpeedPoint& p, double v, double share, bool faster) {
  if (!(p.safe_m_per_s > 0)) return 1;  // at rest
  const double x = std::min(v / p.safe_m_per_s, 1.0),
               r = std::clamp(share, kLeastShare, kMostShare);
  const double log_sample = std::log(kSample);
  switch (p.safe_binding) {
    case Binding::kLateralGrip:
    case Binding::kRollover:
    case Binding::kTraction:
      return std::sqrt(1 - std::pow(x, std::min(4.0, std::log1p(-r * r) / log_sample)));
    case Binding::kTorque:
    case Binding::kUntrainedSpeed:
    case Binding::kModelDomain:
    case Binding::kSinkage:
      if (faster) return kLess * (1 - std::pow(x, std::log1p(-r) / log_sample));
      [[fallthrough]];
    default:
      return std::max(0.0, 1 - (1 - std::min(share, 1.0)) * x / kSample);
  }
}

}  // namespace

/// Accelerations and braking at kSample of the safe speed and at rest, of all knots. Rest is left
/// out where the sample holds all that comfort allows; so is a knot that is equal to the one
/// before.
class SpeedPlanner::Reaching final : public LevelSearch::Items {
 public:
  Reaching(SpeedPlanner* planner, std::span<const PathPoint> path, const SpeedOptions& options,
           std::size_t knots, std::span<const SpeedPoint> plan)
      : planner_(*planner), path_(path), options_(options), knots_(knots), plan_(plan) {
    std::fill_n(planner_.reached_.begin(), kAsked * knots, -1);
  }

  bool Begin(LevelSearch::Track* t) override {
    while (next_ < kAsked * knots_ && Known(next_)) ++next_;
    if (next_ == kAsked * knots_) return false;
    t->item = next_++;
    t->suggested = kReachLevels;
    t->good = planner_.solutions_[Point(t->item)];
    t->light = true;
    return true;
  }
  Motion MotionAt(std::size_t item, int level) const override {
    const std::size_t i = Point(item);
    const double speed = item < 2 * knots_ ? kSample * plan_[i].safe_m_per_s : 0;
    const double most =
        item / knots_ % 2 == 0 ? options_.acceleration_m_per_s2 : -options_.braking_m_per_s2;
    return SpeedPlanner::MotionAt(path_[i], options_, speed, most * level / kReachLevels);
  }
  double Slack(const Solution& s) const override { return planner_.Slack(s, options_); }
  double Shortfall(const Solution& s) const override { return planner_.ShortfallOf(s, options_); }
  void Found(const LevelSearch::Track& t) override {
    planner_.reached_[t.item] = std::max(0, t.low);
  }

  /// Share of comfort, of accelerating or braking, at the sample or at rest.
  double Share(std::size_t k, bool faster, bool at_rest) const {
    std::size_t item = k + (faster ? 0 : knots_) + (at_rest ? 2 * knots_ : 0);
    if (at_rest && Share(k, faster, false) >= 1) return 1;
    while (planner_.reached_[item] < 0) --item;  // of an equal knot
    return static_cast<double>(planner_.reached_[item]) / kReachLevels;
  }

 private:
  static constexpr std::size_t kAsked = 4;  // sample and rest, accelerating and braking

  std::size_t Point(std::size_t item) const { return planner_.knots_[item % knots_]; }
  bool Known(std::size_t item) const {
    if (item >= 2 * knots_ && planner_.reached_[item - 2 * knots_] == kReachLevels) return true;
    if (item % knots_ == 0) return false;
    const std::size_t i = Point(item), before = Point(item - 1);
    const PathPoint &p = path_[i], &q = path_[before];
    return p.soil == q.soil && p.curvature_per_m == q.curvature_per_m &&
           p.grade_rad == q.grade_rad && p.bank_rad == q.bank_rad &&
           plan_[i].safe_m_per_s == plan_[before].safe_m_per_s;
  }

  SpeedPlanner& planner_;
  std::span<const PathPoint> path_;
  const SpeedOptions& options_;
  std::size_t knots_, next_ = 0;
  std::span<const SpeedPoint> plan_;
};

// Points whose reach is searched: both ends of every stretch of one soil that can be driven, and
// some between. Returns how many.
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

// Acceleration and braking within comfort that hold at rest, and the share of them that does at
// kSample of the safe speed: searched at the knots, on the chord elsewhere.
void SpeedPlanner::Reach(std::span<const PathPoint> path, const SpeedOptions& o,
                         std::span<const SpeedPoint> out) {
  const std::size_t n = path.size(), knots = Knots(path, out);
  // What cannot be driven bears all; a step has one acceleration, which both its ends must bear.
  std::fill_n(faster_.begin(), n, o.acceleration_m_per_s2);
  std::fill_n(slower_.begin(), n, o.braking_m_per_s2);
  std::fill_n(faster_share_.begin(), n, 1.0);
  std::fill_n(slower_share_.begin(), n, 1.0);
  std::fill_n(most_faster_.begin(), n, o.acceleration_m_per_s2);
  if (knots == 0) return;
  Reaching reaching(this, path, o, knots, out);
  search_.Run(&solver_, kReachLevels, &reaching);
  for (std::size_t k = 0; k < knots; ++k) {
    const std::size_t i = knots_[k];
    for (const bool faster : {true, false}) {
      const double sample = reaching.Share(k, faster, false);
      const double rest = std::max(sample, reaching.Share(k, faster, true));
      (faster ? faster_ : slower_)[i] *= rest;
      (faster ? faster_share_ : slower_share_)[i] = rest > 0 ? sample / rest : 1;
    }
  }
  for (std::vector<double>* numbers : {&faster_, &slower_, &faster_share_, &slower_share_}) {
    Spread(knots, n, numbers);
  }
}

// From the knots to all steps.
void SpeedPlanner::Spread(std::size_t knots, std::size_t n, std::vector<double>* numbers) const {
  std::vector<double>& of = *numbers;
  for (std::size_t k = 0; k + 1 < knots; ++k) {
    const std::size_t a = knots_[k], b = knots_[k + 1];
    if (b > a + kStride) continue;
    for (std::size_t i = a + 1; i < b; ++i) {
      of[i] = std::lerp(of[a], of[b], static_cast<double>(i - a) / static_cast<double>(b - a));
    }
  }
  for (std::size_t i = 0; i + 1 < n; ++i) of[i] = std::min(of[i], of[i + 1]);
}

void SpeedPlanner::Passes(std::span<const PathPoint> path, const SpeedOptions& o,
                          std::span<SpeedPoint> out) {
  const std::size_t n = path.size();
  for (std::size_t i = 0; i < n; ++i) {
    out[i].speed_m_per_s = cap_[i];
    out[i].binding = failures_[i] > 0 ? slowed_by_[i] : out[i].safe_binding;
  }
  const auto cap = [&](std::size_t i, double v, Binding binding) {
    if (v >= out[i].speed_m_per_s) return;
    out[i].speed_m_per_s = v;
    out[i].binding = binding;
  };
  cap(0, o.start_m_per_s, Binding::kSpeedLimit);
  cap(n - 1, o.end_m_per_s, Binding::kSpeedLimit);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const double v = out[i].speed_m_per_s, d = path[i + 1].s_m - path[i].s_m;
    if (!(out[i + 1].speed_m_per_s > v)) continue;
    const double a =
        std::min(faster_[i] * Left(out[i], v, faster_share_[i], true), most_faster_[i]);
    cap(i + 1, std::sqrt(v * v + 2 * a * d), Binding::kAcceleration);
  }
  for (std::size_t i = n - 1; i-- > 0;) {
    const double v = out[i + 1].speed_m_per_s, d = path[i + 1].s_m - path[i].s_m;
    if (!(out[i].speed_m_per_s > v)) continue;
    const double a = slower_[i] * Left(out[i + 1], v, slower_share_[i], false);
    cap(i, std::sqrt(v * v + 2 * a * d), Binding::kBraking);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t k = std::min(i, n - 2);
    const double a = out[k].speed_m_per_s, b = out[k + 1].speed_m_per_s;
    out[i].acceleration_m_per_s2 = (b * b - a * a) / (2 * (path[k + 1].s_m - path[k].s_m));
  }
}

}  // namespace grouser::vehicle
