#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "surrogate/vehicle/constants.h"
#include "surrogate/vehicle/energy.h"
#include "tests/unit/vehicle/vehicles.h"

namespace grouser::vehicle {
namespace {

using testing::Asphalt;
using testing::Cart;
using testing::OnHard;
using testing::Planning;
using testing::Rover;
using testing::Skid;
using testing::WithFriction;

TEST(Energy, SplitAddsUpToTheElectricPower) {
  for (Vehicle v : {Skid(), Cart(), Rover()}) {
    for (Drive& d : v.drives) d.motor.efficiency = 0.8;
    OnHard on{v};
    Motion motion = Motion::OnPath(0.7, 0.3);
    motion.grade_rad = 0.1;
    motion.bank_rad = -0.05;
    motion.acceleration_m_per_s2 = 0.2;
    motion.yaw_acceleration_rad_per_s2 = 0.06;
    const PowerInterval p = PowerOf(on.solver.get(), motion);
    ASSERT_TRUE(p.solution.balanced) << v.name;
    EXPECT_NEAR(p.mean.Sum(), p.mean.electric, 1e-9 * p.mean.electric) << v.name;
    EXPECT_GT(p.mean.rolling, 0);
    EXPECT_GT(p.mean.slip + p.mean.scrub, 0);
    // Work against gravity by the vehicle's own speeds.
    EXPECT_NEAR(
        p.mean.grade / (v.mass_kg * 9.81),
        std::sin(0.1) * (0.7 - 0.21 * v.centre_y_m) +
            std::cos(0.1) * std::sin(-0.05) * (p.solution.v_y_m_per_s + 0.21 * v.centre_x_m),
        1e-9);
  }
}

TEST(Energy, StraightOnTheLevelIsRollingResistanceAlone) {
  OnHard on{Skid()};
  const PowerInterval p = PowerOf(on.solver.get(), Motion::OnPath(0.8, 0));
  EXPECT_NEAR(p.joules_per_metre, 0.02 * 60 * 9.81, 1e-3);
  EXPECT_NEAR(p.mean.scrub, 0, 1e-9);
}

TEST(Energy, TurningInPlaceScrubs) {
  OnHard on{Skid()};
  Motion motion;
  motion.yaw_rate_rad_per_s = 0.5;
  const PowerInterval p = PowerOf(on.solver.get(), motion);
  ASSERT_TRUE(p.solution.balanced);
  EXPECT_GT(p.mean.scrub, 0.2 * p.mean.shaft);
  EXPECT_TRUE(std::isnan(p.joules_per_metre));
  // All slides sideways: at most friction on every wheel over its speed.
  const double most = 0.8 * 60 * 9.81 * std::hypot(0.25, 0.28 + 0.5) * 0.5;
  EXPECT_LT(p.mean.scrub, most);
}

TEST(Energy, IntervalHoldsTheMeanAndGrowsWithTheGround) {
  surrogate::HardGround ground = Asphalt();
  ground.rolling_resistance_sd = 0.005;
  OnHard on(Skid(), {ground});
  const PowerInterval p = PowerOf(on.solver.get(), Motion::OnPath(0.8, 0));
  EXPECT_LT(p.electric_low, p.mean.electric);
  EXPECT_GT(p.electric_high, p.mean.electric);
  EXPECT_NEAR(p.electric_high - p.electric_low, 2 * 1.645 * 0.005 * 60 * 9.81 * 0.8, 0.02);
}

TEST(Constants, UndoTheSlipOfTheSolve) {
  Planning p(Skid(), {Asphalt()});
  const std::vector<double> speeds = {0.5}, radii = {1.0, 5.0};
  const auto constants = ConstantsOf(Skid(), p.table, speeds, radii);
  ASSERT_EQ(constants.size(), 2u);
  for (const SkidConstants& c : constants) {
    const Solution s = p.on.Solve(Motion::OnPath(c.speed_m_per_s, 1 / c.radius_m));
    const double l = s.rim_speed_m_per_s[0], r = s.rim_speed_m_per_s[1];
    EXPECT_NEAR(c.radius_multiplier * (l + r) / 2, 0.5, 1e-9);
    EXPECT_NEAR((r - l) / (c.separation_multiplier * 0.56), 0.5 / c.radius_m, 1e-9);
    EXPECT_GT(c.separation_multiplier, 1.2);  // skid steering asks for more than geometry
    EXPECT_NEAR(c.pull_over_weight, 0.8, 0.03);
  }
  EXPECT_THROW(ConstantsOf(Cart(), p.table, speeds, radii), std::invalid_argument);
}

// Of some soils alone; those of a mixture lie between those of its soils.
TEST(Constants, OfSoilsThatAreAskedFor) {
  Planning p(Skid(), {Asphalt(), WithFriction(0.3)});
  const std::vector<double> speeds = {0.5}, radii = {1.0, 5.0};
  const auto all = ConstantsOf(Skid(), p.table, speeds, radii);
  ASSERT_EQ(all.size(), 4u);
  const std::vector<std::uint8_t> second = {1}, none = {2};
  const auto some = ConstantsOf(Skid(), p.table, speeds, radii, {}, second);
  ASSERT_EQ(some.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(some[k].soil, "1");
    EXPECT_EQ(some[k].separation_multiplier, all[2 + k].separation_multiplier);
    EXPECT_EQ(some[k].pull_over_weight, all[2 + k].pull_over_weight);
  }
  EXPECT_THROW(ConstantsOf(Skid(), p.table, speeds, radii, {}, none), std::invalid_argument);
}

}  // namespace
}  // namespace grouser::vehicle
