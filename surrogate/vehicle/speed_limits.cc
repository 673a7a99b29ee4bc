// What is within the limits of a plan, what binds, and the questions about one motion.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include "surrogate/vehicle/speed_plan.h"

namespace grouser::vehicle {
namespace {

constexpr double kGradeStep = 2.5 * std::numbers::pi / 180;  // of the first look at grades
constexpr int kGradeSteps = 34;                              // to 85 degrees
constexpr double kGradeResolution = 1e-4;
constexpr double kStanding = 1e-9;  // [m/s]: at rest, about to follow the path
constexpr double kMostSds = 4;
constexpr int kSdHalvings = 12;

}  // namespace

void Need(bool good, const char* field, const char* expected) {
  if (!good) throw std::invalid_argument(std::string(field) + ": expected " + expected);
}

void CheckMargins(const SpeedOptions& o) {
  Need(std::isfinite(o.worse_by_sd), "worse_by_sd", "a finite number");
  Need(o.tip_margin >= 0 && o.tip_margin < 1, "tip_margin", "0 to below 1");
}

const char* NameOf(Binding binding) {
  constexpr const char* kNames[] = {
      "SPEED_LIMIT",     "TRACTION",     "LATERAL_GRIP", "TORQUE",  "ROLLOVER", "SINKAGE",
      "UNTRAINED_SPEED", "MODEL_DOMAIN", "ACCELERATION", "BRAKING", "INPUT"};
  return kNames[static_cast<int>(binding)];
}

Motion SpeedPlanner::MotionAt(const PathPoint& p, const SpeedOptions& options, double speed,
                              double acceleration) {
  Motion m = Motion::OnPath(std::max(speed, kStanding), p.curvature_per_m);
  m.acceleration_m_per_s2 = acceleration;
  m.yaw_acceleration_rad_per_s2 = acceleration * p.curvature_per_m;
  m.grade_rad = p.grade_rad;
  m.bank_rad = p.bank_rad;
  m.worse_by_sd = options.worse_by_sd;
  m.soil.fill(p.soil);
  return m;
}

double SpeedPlanner::Slack(const Solution& s, const SpeedOptions& o) const {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  StopIfAsked(o.stop);
  if (!s.balanced || (s.reasons & (kNoBalance | kTips | kBadInput)) != 0) return kNaN;
  if (o.trained_only && (s.reasons & kModelDomain) != 0) return kNaN;
  if (o.trained_only && (s.reasons & kUntrainedSpeed) != 0 && s.speed_margin >= 0) return kNaN;
  if ((s.reasons & kSinksIn) != 0 && s.sinkage_margin >= 0) return kNaN;  // carried nowhere
  return std::min({s.tip_margin - o.tip_margin, s.torque_margin - std::max(0.0, o.torque_margin),
                   s.sinkage_margin - std::max(0.0, o.sinkage_margin),
                   o.trained_only ? s.speed_margin : 1.0});
}

Binding BindingOf(const Motion& m, const Solution& s, const SpeedOptions& o, double g) {
  if ((s.reasons & kBadInput) != 0) return Binding::kInput;
  if (s.tip_margin < o.tip_margin) return Binding::kRollover;
  if ((s.reasons & kSinksIn) != 0 || s.sinkage_margin < o.sinkage_margin) return Binding::kSinkage;
  if (o.trained_only && ((s.reasons & kUntrainedSpeed) != 0 || s.speed_margin < 0)) {
    return Binding::kUntrainedSpeed;
  }
  if ((s.reasons & kModelDomain) != 0 && (o.trained_only || !s.balanced)) {
    return Binding::kModelDomain;
  }
  if (s.balanced) return Binding::kTorque;
  const double along = std::fabs(m.acceleration_m_per_s2 + g * std::sin(m.grade_rad));
  const double across = std::fabs(m.v_x_m_per_s * m.yaw_rate_rad_per_s + g * std::sin(m.bank_rad));
  return along > across ? Binding::kTraction : Binding::kLateralGrip;
}

double SpeedPlanner::ShortfallOf(const Solution& s, const SpeedOptions& o) const {
  if (!s.balanced) return s.residual;
  return std::max({0.0, o.tip_margin - s.tip_margin, o.torque_margin - s.torque_margin,
                   o.sinkage_margin - s.sinkage_margin, o.trained_only ? -s.speed_margin : 0.0});
}

GradeRange SpeedPlanner::Grades(double speed, std::uint8_t soil, const SpeedOptions& o) {
  CheckMargins(o);
  Need(std::isfinite(speed), "speed", "a finite number");
  Need(soil < soils_, "soil", "one of the vehicle file");
  const auto holds = [&](double grade, Binding* binding) {
    PathPoint p;
    p.grade_rad = grade;
    p.soil = soil;
    const Motion m = MotionAt(p, o, speed, 0);
    Solution s;
    solver_.Solve({&m, 1}, {&s, 1});
    const bool good = Good(s, o);
    if (!good) *binding = BindingOf(m, s, o);
    return good;
  };
  GradeRange range;
  // The grade nearest to level that is driven, then outward to the first that is not.
  int first = 0;
  while (!holds(first * kGradeStep, &range.binding_up)) {
    first = first > 0 ? -first : 1 - first;
    if (first > kGradeSteps) return range;
  }
  const auto edge = [&](int way, Binding* binding) {
    double good = first * kGradeStep, bad = good + way * kGradeStep;
    while (std::fabs(bad) < kGradeSteps * kGradeStep && holds(bad, binding)) {
      good = bad;
      bad += way * kGradeStep;
    }
    while (std::fabs(bad - good) > kGradeResolution) {
      const double middle = (good + bad) / 2;
      (holds(middle, binding) ? good : bad) = middle;
    }
    return good;
  };
  range.any = true;
  range.up_rad = edge(1, &range.binding_up);
  range.down_rad = edge(-1, &range.binding_down);
  return range;
}

bool SpeedPlanner::Goes(const Solution& s, const SpeedOptions& options, bool unknown) const {
  SpeedOptions o = options;
  o.trained_only = !unknown;
  const bool outside =
      !s.balanced && (s.reasons & kUntrained) != 0 && (s.reasons & (kLimits & ~kNoBalance)) == 0;
  return Good(s, o) || (unknown && outside);
}

GoProbability SpeedPlanner::ProbabilityToGo(const Motion& motion, const SpeedOptions& options) {
  // `unknown`: what the runs do not cover goes.
  const auto probability = [&](bool unknown) {
    double low = -kMostSds, high = kMostSds;
    for (int i = 0; i < kSdHalvings; ++i) {
      Motion m = motion;
      m.worse_by_sd = (low + high) / 2;
      Solution s;
      solver_.Solve({&m, 1}, {&s, 1});
      (Goes(s, options, unknown) ? low : high) = m.worse_by_sd;
    }
    return low <= -kMostSds ? 0 : high >= kMostSds ? 1 : 0.5 * std::erfc(-low / std::sqrt(2.0));
  };
  return {probability(false), probability(true)};
}

}  // namespace grouser::vehicle
