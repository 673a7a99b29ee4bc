// Query, job and DEM accept the same states and move the same way in them.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include "dem_offline/engine/rig/kinematics.h"
#include "server/core/status.h"
#include "server/jobs/request_checks.h"
#include "surrogate/models/kinematics.h"

namespace grouser {
namespace {

constexpr double kSpeed = 0.3;

std::optional<dem::Motion> OfDem(double slip, double angle) {
  try {
    return dem::MotionAt(slip, angle, kSpeed);
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
}

bool JobAccepts(double slip, double angle) {
  v1alpha1::TestState state;
  state.set_load_n(10);
  state.set_slip(slip);
  state.set_attack_angle_rad(angle);
  try {
    server::CheckTestState(state);
  } catch (const server::StatusError&) {
    return false;
  }
  return true;
}

/// All three on one state; whether they accept it.
bool Agree(double slip, double angle) {
  const surrogate::VelocityState query = surrogate::FromSlip(slip, angle, kSpeed);
  const bool answered = !std::isnan(query.v_x);
  const std::optional<dem::Motion> run = OfDem(slip, angle);
  EXPECT_EQ(answered, run.has_value()) << "query, DEM: slip " << slip << " at " << angle;
  EXPECT_EQ(answered, JobAccepts(slip, angle)) << "query, job: slip " << slip << " at " << angle;
  if (answered && run) {
    EXPECT_NEAR(run->v_x, query.v_x, 1e-12) << slip << " at " << angle;
    EXPECT_NEAR(run->v_y, query.v_y, 1e-12) << slip << " at " << angle;
    EXPECT_NEAR(run->rim, query.rim_speed, 1e-12) << slip << " at " << angle;
    EXPECT_NEAR(dem::SlipOf(*run), slip, 1e-8);
  }
  return answered;
}

std::vector<double> Angles() {
  std::vector<double> out;
  for (int deg = -180; deg <= 180; deg += 15) out.push_back(deg * M_PI / 180);
  for (const double edge : {M_PI_2 - 1e-10, M_PI_2 + 1e-10, M_PI_2 - 1e-6, M_PI_2 + 1e-6}) {
    out.push_back(edge);
  }
  return out;
}

TEST(KinematicRange, QueryJobAndDemAgreeOnEverySlip) {
  int accepted = 0, refused = 0;
  for (const double angle : Angles()) {
    for (int k = -60; k <= 60; ++k) ++(Agree(0.05 * k, angle) ? accepted : refused);
    const dem::SlipRange dem = dem::SlipsAt(angle);
    const surrogate::SlipRange query = surrogate::SlipsAt(angle);
    EXPECT_EQ(dem.low, query.low);
    EXPECT_EQ(dem.high, query.high);
    EXPECT_TRUE(Agree(dem.low, angle)) << angle;
    EXPECT_TRUE(Agree(dem.high, angle)) << angle;
    EXPECT_TRUE(Agree(dem.low - 1e-11, angle)) << angle;
    EXPECT_TRUE(Agree(dem.high + 1e-11, angle)) << angle;
    EXPECT_FALSE(Agree(dem.low - 1e-6, angle)) << angle;
    EXPECT_FALSE(Agree(dem.high + 1e-6, angle)) << angle;
  }
  EXPECT_GT(accepted, 1000);
  EXPECT_GT(refused, 1000);
}

TEST(KinematicRange, ABackingWheelIsAState) {
  EXPECT_TRUE(Agree(-0.2, M_PI));
  const auto driven = OfDem(-0.2, M_PI), braked = OfDem(0.2, M_PI);
  ASSERT_TRUE(driven && braked);
  EXPECT_NEAR(driven->rim, -kSpeed, 1e-12);
  EXPECT_NEAR(driven->v_x, -0.8 * kSpeed, 1e-12);
  EXPECT_NEAR(braked->rim, -0.8 * kSpeed, 1e-12);
  EXPECT_NEAR(braked->v_x, -kSpeed, 1e-12);
}

TEST(KinematicRange, NobodyAcceptsWhatIsNoState) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  for (const double bad : {kNaN, kInf, -kInf}) {
    EXPECT_FALSE(Agree(bad, 0.3));
    EXPECT_FALSE(Agree(0.1, bad));
  }
  for (const double angle : {3.2, -3.2, 6.0}) EXPECT_FALSE(Agree(0.1, angle));
}

/// Velocities of every quadrant, rim forward, backward and locked, and STATIC.
TEST(KinematicRange, SlipOfAVelocityIsTheSameAndAccepted) {
  for (int x = -4; x <= 4; ++x) {
    for (int y = -4; y <= 4; ++y) {
      for (int r = -6; r <= 6; ++r) {
        const double v_x = 0.1 * x, v_y = 0.1 * y, rim = 0.1 * r;
        const surrogate::SlipState state = surrogate::ToSlip(v_x, v_y, rim);
        EXPECT_NEAR(dem::SlipOf({v_x, v_y, rim}), state.slip, 1e-12);
        EXPECT_EQ(state.is_static, x == 0 && y == 0 && r == 0);
        EXPECT_TRUE(Agree(state.slip, state.attack_angle_rad)) << v_x << " " << v_y << " " << rim;
      }
    }
  }
}

}  // namespace
}  // namespace grouser
