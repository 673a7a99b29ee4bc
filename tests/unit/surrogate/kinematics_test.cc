#include "surrogate/models/kinematics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/unit/surrogate/small_wheel.h"

namespace grouser::surrogate {
namespace {

TEST(ToSlip, ClassicalSlipAtAttackAngleZero) {
  EXPECT_DOUBLE_EQ(ToSlip(0.08, 0, 0.1).slip, 0.2);   // driving: 1 - v/(r w)
  EXPECT_DOUBLE_EQ(ToSlip(0.1, 0, 0.08).slip, -0.2);  // braking: r w/v - 1
  EXPECT_DOUBLE_EQ(ToSlip(0.1, 0, 0).slip, -1);       // locked
  EXPECT_DOUBLE_EQ(ToSlip(0.1, 0, -0.1).slip, -2);    // full counter-rotation
  EXPECT_DOUBLE_EQ(ToSlip(0, 0, 0.1).slip, 1);        // spinning in place
  EXPECT_DOUBLE_EQ(ToSlip(0, 0.1, 0).attack_angle_rad, kPi / 2);
  EXPECT_TRUE(ToSlip(0, -0.0, 0).is_static);
}

TEST(ToSlip, IsTheInverseOfFromSlipWhereAMotionExists) {
  int possible = 0;
  for (double slip = -2; slip <= 2.0001; slip += 0.05) {
    for (double angle = -kPi + 0.05; angle < kPi; angle += 0.1) {
      const VelocityState v = FromSlip(slip, angle, 0.3);
      if (std::isnan(v.v_x)) continue;
      const SlipState s = ToSlip(v.v_x, v.v_y, v.rim_speed);
      EXPECT_NEAR(s.slip, slip, 1e-12);
      if (std::hypot(v.v_x, v.v_y) > 1e-9) {
        EXPECT_NEAR(s.attack_angle_rad, angle, 1e-9);
      }
      EXPECT_NEAR(std::max(std::fabs(v.rim_speed), std::hypot(v.v_x, v.v_y)), 0.3, 1e-12);
      ++possible;
    }
  }
  EXPECT_GT(possible, 2000);
}

TEST(FromSlip, GivesBackEveryForwardMotion) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int i = 0; i < 20000; ++i) {
    const double v_x = std::fabs(any(random)) + 1e-3, v_y = any(random), rim = any(random);
    const double hub = std::hypot(v_x, v_y);
    if (rim < -hub) continue;  // shares its slip with a slower rim
    const SlipState s = ToSlip(v_x, v_y, rim);
    const VelocityState v = FromSlip(s.slip, s.attack_angle_rad, std::max(std::fabs(rim), hub));
    EXPECT_NEAR(v.v_x, v_x, 1e-9);
    EXPECT_NEAR(v.v_y, v_y, 1e-9);
    EXPECT_NEAR(v.rim_speed, rim, 1e-9);
  }
}

TEST(FromSlip, RefusesWhatNoMotionHas) {
  for (const auto& [slip, angle, speed] :
       {std::array{1.5, 0.0, 0.1}, std::array{-1.9, 1.4, 0.1}, std::array{2.5, 0.0, 0.1},
        std::array{std::nan(""), 0.0, 0.1}, std::array{0.1, std::nan(""), 0.1},
        std::array{0.1, 4.0, 0.1}, std::array{0.1, 0.1, 0.0}, std::array{0.1, 0.1, -1.0},
        std::array{0.1, 0.1, std::numeric_limits<double>::infinity()}}) {
    EXPECT_TRUE(std::isnan(FromSlip(slip, angle, speed).v_x)) << slip << " " << angle;
  }
}

TEST(FromSlip, MirrorsInXTurnsSlipAndAngle) {
  for (const double slip : {-1.5, -0.3, 0.2, 0.8}) {
    for (const double angle : {0.1, 0.7, 1.5}) {
      const VelocityState a = FromSlip(slip, angle, 1), b = FromSlip(-slip, kPi - angle, 1);
      if (std::isnan(a.v_x)) {
        EXPECT_TRUE(std::isnan(b.v_x));
        continue;
      }
      EXPECT_NEAR(a.v_x, -b.v_x, 1e-12);
      EXPECT_NEAR(a.v_y, b.v_y, 1e-12);
      EXPECT_NEAR(a.rim_speed, -b.rim_speed, 1e-12);
    }
  }
}

TEST(Canonical, MirroredStatesShareTheSameHalfSpace) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> any(-2, 2);
  for (int i = 0; i < 1000; ++i) {
    const double x = any(random), y = any(random), u = any(random);
    const Canonical a = ToCanonical(x, y, u), b = ToCanonical(-x, y, -u), c = ToCanonical(x, -y, u);
    for (const Canonical& other : {b, c}) {
      EXPECT_EQ(a.forward, other.forward);
      EXPECT_EQ(a.lateral, other.lateral);
      EXPECT_EQ(a.rim, other.rim);
    }
    EXPECT_EQ(a.sign_x, -b.sign_x);
    EXPECT_EQ(a.sign_y, -c.sign_y);
    EXPECT_GE(a.forward, 0);
    const ChartPoint chart = ToChart(a);
    EXPECT_LE(std::fabs(chart.direction_rad), kPi / 2);
    EXPECT_GE(chart.lateral_rad, 0);
  }
}

}  // namespace
}  // namespace grouser::surrogate
