#include "surrogate/vehicle/speed_plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace grouser::vehicle {
namespace {

constexpr int kBisections = 8;             // of the safe speed: to 0.4 % of the limit
constexpr std::size_t kStride = 8;         // points between those whose reach is searched
constexpr double kResolution = 1.0 / 256;  // of the safe speed, over the limit
constexpr int kMostVerifications = 100;

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

Motion MotionAt(const PathPoint& p, const SpeedOptions& options, double speed,
                double acceleration) {
  Motion m = Motion::OnPath(speed, p.curvature_per_m);
  m.acceleration_m_per_s2 = acceleration;
  m.yaw_acceleration_rad_per_s2 = acceleration * p.curvature_per_m;
  m.grade_rad = p.grade_rad;
  m.bank_rad = p.bank_rad;
  m.worse_by_sd = options.worse_by_sd;
  m.soil.fill(p.soil);
  return m;
}

void CheckOptions(const SpeedOptions& o) {
  const auto need = [](bool good, const char* field, const char* expected) {
    if (!good) throw std::invalid_argument(std::string(field) + ": expected " + expected);
  };
  need(o.speed_limit_m_per_s > 0 && std::isfinite(o.speed_limit_m_per_s), "speed_limit_m_per_s",
       "a finite number above 0");
  need(std::isfinite(o.worse_by_sd), "worse_by_sd", "a finite number");
  need(o.acceleration_m_per_s2 > 0 && o.braking_m_per_s2 > 0, "acceleration, braking",
       "numbers above 0");
  need(o.start_m_per_s >= 0 && o.end_m_per_s >= 0, "start, end", "speeds from 0 on");
  need(o.tip_margin >= 0 && o.tip_margin < 1, "tip_margin", "0 to 1");
}

}  // namespace

const char* NameOf(Binding binding) {
  constexpr const char* kNames[] = {
      "SPEED_LIMIT",     "TRACTION",     "LATERAL_GRIP", "TORQUE",  "ROLLOVER", "SINKAGE",
      "UNTRAINED_SPEED", "MODEL_DOMAIN", "ACCELERATION", "BRAKING", "INPUT"};
  return kNames[static_cast<int>(binding)];
}

SpeedPlanner::SpeedPlanner(const Vehicle& vehicle, const Grounds& grounds, std::size_t most)
    : vehicle_(vehicle),
      soils_(grounds.soils.size()),
      solver_(vehicle, grounds),
      motions_(most),
      solutions_(most),
      open_(most),
      knots_(most),
      low_(most),
      high_(most),
      cap_(most),
      faster_(most),
      slower_(most),
      tried_speed_(most),
      tried_acceleration_(most),
      failures_(most),
      slowed_by_(most) {}

bool SpeedPlanner::Good(const Solution& s, const SpeedOptions& o) const {
  if (!s.balanced || (s.reasons & kLimits) != 0) return false;
  if (o.trained_only && (s.reasons & kUntrained) != 0) return false;
  return s.tip_margin >= o.tip_margin && s.torque_margin >= o.torque_margin &&
         s.sinkage_margin >= o.sinkage_margin;
}

Binding SpeedPlanner::BindingOf(const Motion& m, const Solution& s, const SpeedOptions& o) const {
  if ((s.reasons & kBadInput) != 0) return Binding::kInput;
  if (s.tip_margin < o.tip_margin) return Binding::kRollover;
  if ((s.reasons & kSinksIn) != 0 || s.sinkage_margin < o.sinkage_margin) return Binding::kSinkage;
  if (o.trained_only && (s.reasons & kUntrainedSpeed) != 0) return Binding::kUntrainedSpeed;
  if ((s.reasons & kModelDomain) != 0 && (o.trained_only || !s.balanced)) {
    return Binding::kModelDomain;
  }
  if (s.balanced) return Binding::kTorque;
  const double g = vehicle_.gravity_m_per_s2;
  const double along = std::fabs(m.acceleration_m_per_s2 + g * std::sin(m.grade_rad));
  const double across = std::fabs(m.v_x_m_per_s * m.yaw_rate_rad_per_s + g * std::sin(m.bank_rad));
  return along > across ? Binding::kTraction : Binding::kLateralGrip;
}

double SpeedPlanner::ShortfallOf(const Solution& s, const SpeedOptions& o) const {
  if (!s.balanced) return s.residual;
  return std::max({0.0, o.tip_margin - s.tip_margin, o.torque_margin - s.torque_margin,
                   o.sinkage_margin - s.sinkage_margin});
}

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

void SpeedPlanner::Passes(std::span<const PathPoint> path, const SpeedOptions& o,
                          std::span<SpeedPoint> out) {
  const std::size_t n = path.size();
  // What is left along the path where grip is used across it: an ellipse in speed^2.
  const auto left = [&](std::size_t i, double v) {
    const Binding b = out[i].safe_binding;
    if (b != Binding::kLateralGrip && b != Binding::kRollover && b != Binding::kTraction)
      return 1.0;
    if (!(out[i].safe_m_per_s > 0)) return 1.0;  // at rest
    const double share = v / out[i].safe_m_per_s;
    return std::sqrt(std::max(0.0, 1 - share * share * share * share));
  };
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
    cap(i + 1, std::sqrt(v * v + 2 * faster_[i] * left(i, v) * d), Binding::kAcceleration);
  }
  for (std::size_t i = n - 1; i-- > 0;) {
    const double v = out[i + 1].speed_m_per_s, d = path[i + 1].s_m - path[i].s_m;
    cap(i, std::sqrt(v * v + 2 * slower_[i] * left(i + 1, v) * d), Binding::kBraking);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t k = std::min(i, n - 2);
    const double a = out[k].speed_m_per_s, b = out[k + 1].speed_m_per_s;
    out[i].acceleration_m_per_s2 = (b * b - a * a) / (2 * (path[k + 1].s_m - path[k].s_m));
  }
}

// Solves the points whose speed or acceleration is new, slows those that do not hold. False: none
// was slowed.
bool SpeedPlanner::Verify(std::span<const PathPoint> path, const SpeedOptions& o,
                          std::span<SpeedPoint> out) {
  std::size_t open = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double v = out[i].speed_m_per_s, a = out[i].acceleration_m_per_s2;
    if (v == tried_speed_[i] && a == tried_acceleration_[i]) continue;
    tried_speed_[i] = v;
    tried_acceleration_[i] = a;
    motions_[open] = MotionAt(path[i], o, v, a);
    open_[open++] = i;
  }
  solver_.Solve(std::span(motions_).first(open), std::span(solutions_).first(open));
  bool slowed = false;
  for (std::size_t k = 0; k < open; ++k) {
    const std::size_t i = open_[k];
    out[i].holds = Good(solutions_[k], o);
    if (out[i].holds || !(out[i].safe_m_per_s > 0)) continue;
    if (out[i].speed_m_per_s == 0 && out[i].acceleration_m_per_s2 == 0) continue;  // no slower
    slowed = true;
    slowed_by_[i] = BindingOf(motions_[k], solutions_[k], o);
    Slow(i, out);
  }
  return slowed;
}

// Point i bears less acceleration, and of the two ends of its step the faster is too fast.
void SpeedPlanner::Slow(std::size_t i, std::span<const SpeedPoint> out) {
  const Slowing left = SlowingOf(++failures_[i]);
  const std::size_t last = out.size() - 1, step = std::min(i, last - 1);
  const bool accelerates = out[i].acceleration_m_per_s2 > 0;
  (accelerates ? faster_ : slower_)[step] *= left.acceleration;
  cap_[i] = std::min(cap_[i], left.speed * out[i].speed_m_per_s);
  if (!accelerates || i == last) return;
  cap_[i + 1] = std::min(cap_[i + 1], left.speed * out[i + 1].speed_m_per_s);
  if (failures_[i + 1]++ == 0) slowed_by_[i + 1] = slowed_by_[i];
}

// Points that do not hold. What stands still up to the next point is not driven either, nor is a
// start that is faster than what the path ahead allows.
std::size_t SpeedPlanner::NotHeld(const SpeedOptions& o, std::span<SpeedPoint> out) const {
  if (o.start_m_per_s > out[0].speed_m_per_s + kResolution * o.speed_limit_m_per_s) {
    out[0].holds = false;
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const bool moves = i + 1 == out.size() || out[i].speed_m_per_s + out[i + 1].speed_m_per_s > 0;
    out[i].holds = out[i].holds && out[i].safe_m_per_s > 0 && moves;
    count += !out[i].holds;
  }
  return count;
}

std::size_t SpeedPlanner::Plan(std::span<const PathPoint> path, const SpeedOptions& options,
                               std::span<SpeedPoint> out) {
  const auto fail = [](std::size_t i, const std::string& what) {
    throw std::invalid_argument("path point " + std::to_string(i) + ": " + what);
  };
  if (path.size() < 2 || path.size() > motions_.size() || out.size() != path.size()) {
    throw std::invalid_argument("path: got " + std::to_string(path.size()) +
                                " points, expected 2 to " + std::to_string(motions_.size()) +
                                " and as many answers");
  }
  CheckOptions(options);
  for (std::size_t i = 0; i < path.size(); ++i) {
    const PathPoint& p = path[i];
    if (!std::isfinite(p.s_m + p.curvature_per_m + p.grade_rad + p.bank_rad)) {
      fail(i, "got a number that is not finite");
    }
    if (i > 0 && !(p.s_m > path[i - 1].s_m)) {
      fail(i, "s_m: got " + std::to_string(p.s_m) + ", expected more than that before");
    }
    if (p.soil >= soils_) fail(i, "soil: expected one of the vehicle file");
  }
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

double SpeedPlanner::SteepestGrade(double speed, std::uint8_t soil, const SpeedOptions& o) {
  double low = -0.5, high = 1.5;
  while (high - low > 1e-4) {
    PathPoint p;
    p.grade_rad = (low + high) / 2;
    p.soil = soil;
    const Motion m = MotionAt(p, o, speed, 0);
    Solution s;
    solver_.Solve({&m, 1}, {&s, 1});
    (Good(s, o) ? low : high) = p.grade_rad;
  }
  return low;
}

double SpeedPlanner::GoProbability(const Motion& motion, const SpeedOptions& o) {
  double low = -4, high = 4;
  for (int i = 0; i < 12; ++i) {
    Motion m = motion;
    m.worse_by_sd = (low + high) / 2;
    Solution s;
    solver_.Solve({&m, 1}, {&s, 1});
    (Good(s, o) ? low : high) = m.worse_by_sd;
  }
  return low <= -4 ? 0 : high >= 4 ? 1 : 0.5 * std::erfc(-low / std::sqrt(2.0));
}

}  // namespace grouser::vehicle
