// What a vehicle can accelerate and brake along a path, and the passes over that.
#include <algorithm>
#include <cmath>

#include "surrogate/vehicle/speed_plan.h"
#include "surrogate/vehicle/speed_question.h"

namespace grouser::vehicle {
namespace {

constexpr int kReachLevels = 32;     // of acceleration and braking
constexpr std::size_t kStride = 32;  // points between those whose reach is searched
constexpr std::size_t kSpacing = 1;  // of these between those that are searched from nothing
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

// At the first `count` of the questions (knots of accelerating, then of braking), at a part of the
// safe speed.
void SpeedPlanner::SearchReach(std::size_t count, const SpeedOptions& o, double part,
                               std::span<const SpeedPoint> out) {
  for (std::size_t k = 0; k < count; ++k) knot_speed_[k] = part * out[knots_[k]].safe_m_per_s;
  path_search_.Run(&search_, &solver_, std::span(knot_points_).first(count), apart_, kReachLevels,
                   kSpacing, /*each=*/false,
                   Question(*this, o, 1.0 / kReachLevels, knot_speed_, knots_, knot_most_),
                   reached_, tried_);
}

// Adds the knots of one way, accelerating or braking, to the questions; returns how many there are.
std::size_t SpeedPlanner::AddKnots(std::span<const PathPoint> path, double most, std::size_t count,
                                   std::span<const SpeedPoint> out) {
  const std::size_t n = path.size(), first = count;
  const auto drives = [&](std::size_t i) { return out[i].safe_m_per_s > 0; };
  const auto joined = [&](std::size_t i) {  // with the next point
    return i + 1 < n && drives(i + 1) && path[i + 1].soil == path[i].soil;
  };
  std::size_t since = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (!drives(i)) continue;
    const bool begins = i == 0 || !drives(i - 1) || !joined(i - 1);
    if (!begins && joined(i) && ++since < kStride) continue;
    apart_[count] = begins || count == first;
    knot_points_[count] = path[i];
    knot_most_[count] = most;
    knots_[count++] = i;
    since = 0;
  }
  return count;
}

// Acceleration and braking within comfort that hold at kSample of the safe speed and, where that is
// not all of it, at rest: searched at both ends of every stretch of one soil that can be driven and
// at some points between, on the chord elsewhere.
void SpeedPlanner::Reach(std::span<const PathPoint> path, const SpeedOptions& o,
                         std::span<const SpeedPoint> out) {
  const std::size_t n = path.size();
  // What cannot be driven bears all; a step has one acceleration, which both its ends must bear.
  std::fill_n(faster_.begin(), n, o.acceleration_m_per_s2);
  std::fill_n(slower_.begin(), n, o.braking_m_per_s2);
  std::fill_n(faster_share_.begin(), n, 1.0);
  std::fill_n(slower_share_.begin(), n, 1.0);
  std::fill_n(most_faster_.begin(), n, o.acceleration_m_per_s2);
  const std::size_t half = AddKnots(path, o.acceleration_m_per_s2, 0, out);
  const std::size_t knots = AddKnots(path, -o.braking_m_per_s2, half, out);
  const auto held = [&](std::size_t k) {
    return std::fabs(knot_most_[k]) / kReachLevels * std::max(0, path_search_.nodes()[k].level);
  };
  const auto reach = [&](std::size_t k) -> double& {
    return (knot_most_[k] > 0 ? faster_ : slower_)[knots_[k]];
  };
  const auto share = [&](std::size_t k) -> double& {
    return (knot_most_[k] > 0 ? faster_share_ : slower_share_)[knots_[k]];
  };
  SearchReach(knots, o, kSample, out);
  std::size_t less = 0;
  for (std::size_t k = 0; k < knots; ++k) {
    share(k) = held(k) / std::fabs(knot_most_[k]);
    if (!(share(k) < 1)) continue;
    const bool begins = less == 0 || apart_[k] || knot_most_[less - 1] != knot_most_[k] ||
                        knots_[k] > knots_[less - 1] + kStride;
    apart_[less] = begins;
    knot_points_[less] = knot_points_[k];
    knot_most_[less] = knot_most_[k];
    knots_[less++] = knots_[k];
  }
  SearchReach(less, o, 0, out);
  for (std::size_t k = 0; k < less; ++k) {
    const double sampled = share(k) * std::fabs(knot_most_[k]);
    reach(k) = std::max(held(k), sampled);
    share(k) = reach(k) > 0 ? sampled / reach(k) : 1;
  }
  const std::size_t all = AddKnots(path, o.acceleration_m_per_s2, 0, out);
  for (std::vector<double>* numbers : {&faster_, &slower_, &faster_share_, &slower_share_}) {
    Spread(all, n, numbers);
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
