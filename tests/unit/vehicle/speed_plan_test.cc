#include "surrogate/vehicle/speed_plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "tests/unit/vehicle/vehicles.h"

namespace grouser::vehicle {
namespace {

using testing::Asphalt;
using testing::Cart;
using testing::Planning;
using testing::Skid;
using testing::WithFriction;

// As fast as that, with no margin against tipping.
SpeedOptions AtMost(double speed) {
  SpeedOptions options;
  options.speed_limit_m_per_s = speed;
  options.tip_margin = 0;
  return options;
}

TEST(SpeedPlan, CornersAtTheSpeedOfFriction) {
  // v^2 kappa = mu g, less what the rolling resistance takes.
  surrogate::HardGround ground = WithFriction(0.4);
  ground.rolling_resistance = 0;
  Vehicle v = Cart();
  v.centre_z_m = 0.02;  // no load transfer: all wheels reach their friction together
  Planning p(v, {ground});
  const double curvature = 0.2, limit = std::sqrt(0.4 * 9.81 / curvature);
  std::vector<PathPoint> path(3);
  for (std::size_t i = 0; i < 3; ++i) path[i] = {static_cast<double>(i), curvature, 0, 0, 0};
  std::vector<SpeedPoint> out(3);
  const SpeedOptions options = AtMost(10);
  p.planner->Plan(path, options, out);
  EXPECT_NEAR(out[1].safe_m_per_s, limit, 0.06 * limit);
  EXPECT_LE(out[1].safe_m_per_s, limit);
  EXPECT_EQ(out[1].safe_binding, Binding::kLateralGrip);
}

TEST(SpeedPlan, RollsOverBeforeItSlides) {
  Vehicle v = Cart(Coupling::kLocked);
  v.centre_z_m = 0.6;
  Planning p(v, {WithFriction(2)});
  const double curvature = 0.2, rollover = std::sqrt(9.81 * 0.35 / (0.6 * curvature));
  std::vector<PathPoint> path = {{0, curvature}, {1, curvature}};
  std::vector<SpeedPoint> out(2);
  const SpeedOptions options = AtMost(10);
  p.planner->Plan(path, options, out);
  EXPECT_NEAR(out[0].safe_m_per_s, rollover, 0.005 * 10);
  EXPECT_EQ(out[0].safe_binding, Binding::kRollover);
}

TEST(SpeedPlan, BrakesInTimeForACornerAndHoldsEverywhere) {
  Planning p(Skid(), {Asphalt(), WithFriction(0.1)});
  std::vector<PathPoint> path;
  for (int i = 0; i < 200; ++i) {
    PathPoint point;
    point.s_m = 0.1 * i;
    point.curvature_per_m = i > 90 && i < 120 ? 0.8 : 0;
    point.soil = i > 150;
    path.push_back(point);
  }
  std::vector<SpeedPoint> out(path.size());
  SpeedOptions options;
  options.speed_limit_m_per_s = 3;
  p.planner->Plan(path, options, out);
  EXPECT_EQ(out[0].speed_m_per_s, 0);
  EXPECT_EQ(out.back().speed_m_per_s, 0);
  EXPECT_EQ(out[80].binding == Binding::kBraking || out[80].speed_m_per_s == 3, true);
  for (std::size_t i = 0; i < path.size(); ++i) {
    ASSERT_LE(out[i].speed_m_per_s, out[i].safe_m_per_s + 1e-12) << i;
    if (i + 1 == path.size()) continue;
    // What the plan asks for can be done: solved anew.
    Motion m = Motion::OnPath(out[i].speed_m_per_s, path[i].curvature_per_m);
    m.acceleration_m_per_s2 = out[i].acceleration_m_per_s2;
    m.yaw_acceleration_rad_per_s2 = m.acceleration_m_per_s2 * path[i].curvature_per_m;
    m.soil.fill(path[i].soil);
    EXPECT_EQ(p.on.Solve(m).reasons & kLimits, 0u)
        << i << " v " << out[i].speed_m_per_s << " a " << out[i].acceleration_m_per_s2;
  }
}

// Solved anew: whether a point of a plan stands with its speed and acceleration.
bool Stands(Planning* p, const PathPoint& at, const SpeedPoint& plan, double worse_by_sd) {
  Motion m = Motion::OnPath(plan.speed_m_per_s, at.curvature_per_m);
  m.acceleration_m_per_s2 = plan.acceleration_m_per_s2;
  m.yaw_acceleration_rad_per_s2 = plan.acceleration_m_per_s2 * at.curvature_per_m;
  m.grade_rad = at.grade_rad;
  m.bank_rad = at.bank_rad;
  m.worse_by_sd = worse_by_sd;
  m.soil.fill(at.soil);
  const Solution s = p->on.Solve(m);
  return s.balanced && (s.reasons & kLimits) == 0;
}

// Patches of ice, as short as a point, in curves and on slopes: shorter than the distance of the
// points whose acceleration is searched.
TEST(SpeedPlan, SlowsDownUntilItHoldsOnPatchesOfIce) {
  Planning p(Skid(), {Asphalt(), WithFriction(0.15)});
  std::vector<PathPoint> path(300);
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double s = 0.1 * static_cast<double>(i);
    path[i] = {s, 0.5 * std::sin(s / 3), 0.05 * std::sin(s / 2), 0, i % 37 < 1 + i / 60};
  }
  std::vector<SpeedPoint> out(path.size());
  SpeedOptions options;
  options.speed_limit_m_per_s = 3;
  EXPECT_EQ(p.planner->Plan(path, options, out), 0u);
  for (std::size_t i = 0; i < path.size(); ++i) {
    EXPECT_TRUE(out[i].holds) << i;
    EXPECT_TRUE(Stands(&p, path[i], out[i], options.worse_by_sd)) << i;
    EXPECT_EQ(out[i].speed_m_per_s > 0, i > 0 && i + 1 < path.size()) << i;
  }
}

TEST(SpeedPlan, SaysWhereItDoesNotHold) {
  Planning p(Skid(), {WithFriction(0.15)});
  std::vector<PathPoint> path(40);
  for (std::size_t i = 0; i < path.size(); ++i) path[i].s_m = 0.5 * static_cast<double>(i);
  for (std::size_t i = 20; i < 25; ++i) path[i].bank_rad = 0.2;  // slides off at any speed
  std::vector<SpeedPoint> out(path.size());
  SpeedOptions options;
  options.speed_limit_m_per_s = 2;
  EXPECT_EQ(p.planner->Plan(path, options, out), 5u);
  for (std::size_t i = 0; i < path.size(); ++i) {
    EXPECT_EQ(out[i].holds, i < 20 || i > 24) << i;
    if (out[i].holds) continue;
    EXPECT_EQ(out[i].speed_m_per_s, 0) << i;
    EXPECT_EQ(out[i].binding, Binding::kLateralGrip) << i;
  }
}

// A curve banked so that it is driven at speed and slides at rest: a start from rest stays there.
TEST(SpeedPlan, SaysWhereItIsTooSlow) {
  Planning p(Cart(), {WithFriction(0.15)});
  std::vector<PathPoint> path(20);
  for (std::size_t i = 0; i < path.size(); ++i) {
    path[i] = {static_cast<double>(i), 0.2, 0, -0.3, 0};
  }
  std::vector<SpeedPoint> out(path.size());
  SpeedOptions options;
  options.speed_limit_m_per_s = std::sqrt(9.81 * std::tan(0.3) / 0.2);  // no force across
  options.start_m_per_s = options.end_m_per_s = options.speed_limit_m_per_s;
  EXPECT_EQ(p.planner->Plan(path, options, out), 0u);
  options.start_m_per_s = 0;
  EXPECT_EQ(p.planner->Plan(path, options, out), path.size());
  EXPECT_EQ(out[3].safe_m_per_s, options.speed_limit_m_per_s);
}

TEST(SpeedPlan, SaysWhereItStartsTooFast) {
  Planning p(Skid(), {Asphalt()});
  std::vector<PathPoint> path(10);
  for (std::size_t i = 0; i < path.size(); ++i) path[i].s_m = 0.1 * static_cast<double>(i);
  std::vector<SpeedPoint> out(path.size());
  SpeedOptions options;
  options.speed_limit_m_per_s = options.start_m_per_s = 3;  // 0.9 m are too short to stop
  EXPECT_EQ(p.planner->Plan(path, options, out), 1u);
  EXPECT_FALSE(out[0].holds);
  EXPECT_EQ(out[0].binding, Binding::kBraking);
}

TEST(SpeedPlan, SteepestGradeIsThatOfFriction) {
  surrogate::HardGround ground = WithFriction(0.5);
  Planning p(Skid(0.25, 0.28, 0.1), {ground});
  SpeedOptions options = AtMost(1);
  for (const double speed : {0.0, 0.3}) {
    const GradeRange grades = p.planner->Grades(speed, 0, options);
    ASSERT_TRUE(grades.any);
    EXPECT_NEAR(grades.up_rad, std::atan(0.5), 2e-3);
    EXPECT_NEAR(grades.down_rad, -std::atan(0.5), 2e-3);
    EXPECT_EQ(grades.binding_up, Binding::kTraction);
    EXPECT_EQ(grades.binding_down, Binding::kTraction);
  }
  options.torque_margin = 2;  // on no grade
  EXPECT_FALSE(p.planner->Grades(0, 0, options).any);
  EXPECT_THROW(p.planner->Grades(0, 1, options), std::invalid_argument);
}

// Worse ground holds less both ways: driving up and braking down.
TEST(SpeedPlan, WorseGroundBrakesLess) {
  surrogate::HardGround ground = WithFriction(0.15);
  ground.friction_sd = 0.05;
  Planning p(Skid(0.25, 0.28, 0.1), {ground});
  SpeedOptions options;
  options.worse_by_sd = 0;
  const GradeRange mean = p.planner->Grades(0.3, 0, options);
  options.worse_by_sd = 1.645;
  const GradeRange worse = p.planner->Grades(0.3, 0, options);
  EXPECT_NEAR(mean.down_rad, -std::atan(0.15), 2e-3);
  EXPECT_NEAR(worse.up_rad, -worse.down_rad, 0.02 * worse.up_rad);
  EXPECT_LT(worse.up_rad, 0.7 * mean.up_rad);
}

TEST(SpeedPlan, ProbabilityToGoFallsWithTheSlope) {
  surrogate::HardGround ground = WithFriction(0.5);
  ground.friction_sd = 0.05;
  Planning p(Skid(0.25, 0.28, 0.1), {ground});
  SpeedOptions options = AtMost(1);
  Motion m = Motion::OnPath(0.3, 0);
  for (const double sds : {-1.0, 0.0, 1.0}) {  // friction needed: mean + sds sd
    m.grade_rad = std::atan(0.5 + sds * 0.05);
    const GoProbability go = p.planner->ProbabilityToGo(m, options);
    EXPECT_NEAR(go.least, 0.5 * std::erfc(sds / std::sqrt(2.0)), 0.02) << sds;
    EXPECT_EQ(go.most, go.least);
  }
}

// Each of them is finite, their sum is not.
TEST(SpeedPlan, TakesNumbersWhoseSumOverflows) {
  Planning p(Skid(), {Asphalt()});
  const std::vector<PathPoint> path = {{-1e308, 1e308, 1e308, 1e308, 0},
                                       {1e308, 1e308, 1e308, 1e308, 0}};
  std::vector<SpeedPoint> out(path.size());
  SpeedOptions options;
  options.speed_limit_m_per_s = 1;
  EXPECT_EQ(p.planner->Plan(path, options, out), 2u);  // driven at neither
}

TEST(SpeedPlan, RefusesPathsByPoint) {
  Planning p(Skid(), {Asphalt()});
  SpeedOptions options;
  options.speed_limit_m_per_s = 1;
  const auto refusal = [&](std::vector<PathPoint> path) -> std::string {
    std::vector<SpeedPoint> out(path.size());
    try {
      p.planner->Plan(path, options, out);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refusal({{0}}).find("got 1 points, expected 2"), std::string::npos);
  EXPECT_NE(refusal({{0}, {0}}).find("path point 1: s_m"), std::string::npos);
  EXPECT_NE(refusal({{0}, {1, NAN}}).find("path point 1: got a number"), std::string::npos);
  EXPECT_NE(refusal({{0}, {1, 0, 0, 0, 3}}).find("path point 1: soil"), std::string::npos);
  options.speed_limit_m_per_s = 0;
  EXPECT_NE(refusal({{0}, {1}}).find("speed_limit"), std::string::npos);
}

}  // namespace
}  // namespace grouser::vehicle
