// How far and how deep a wheel test goes, and from where its sinkage counts.
#include <gtest/gtest.h>

#include <cmath>

#include "dem_offline/engine/rig/wheel_step.h"
#include "dem_offline/engine/rig/wheel_test.h"
#include "tests/unit/engine/rig_testing.h"

namespace grouser::dem {
namespace {

/// A rule that is met at the first look, so that only the travel holds a run.
WheelTestSpec SoonPrecise() {
  WheelTestSpec s = Small();
  s.rig.max_time_s = 3;
  s.rig.target_relative_error = 0.1;
  s.rig.scene = ReducedDomain();
  return s;
}

TEST(Travel, NoRunStopsBeforeItsHubHasGoneFarEnough) {
  WheelTestSpec s = SoonPrecise();
  s.rig.travel.least_hub_m = 0.01;
  const WheelTestResult brief = RunWheelTest(s, SmallTile(), nullptr);
  ASSERT_EQ(brief.stopped, StopCause::kPrecise);
  s.rig.travel.least_hub_m = brief.hub_travel_m + 0.03;
  const WheelTestResult longer = RunWheelTest(s, SmallTile(), nullptr);
  EXPECT_GE(longer.hub_travel_m, s.rig.travel.least_hub_m);
  EXPECT_EQ(longer.series.hub_travel_m.size(), longer.series.time_s.size());
  // At slip 0.3 the rim goes farther than the hub, which is what counts.
  EXPECT_GT(longer.series.travel_m.back(), 1.3 * longer.series.hub_travel_m.back());
}

TEST(Travel, ComparesRunsWhereTheyHaveGoneEquallyFar) {
  WheelTestSpec s = Small();
  s.rig.max_time_s = 0.6;
  s.rig.travel = {0, 0.02, 0.035};
  const WheelTestResult r = RunWheelTest(s, SmallTile(), nullptr);
  ASSERT_EQ(r.equal_travel.outputs.size(), r.outputs.size());
  double sum = 0, n = 0;
  for (std::size_t i = 0; i < r.series.time_s.size(); ++i) {
    if (r.series.hub_travel_m[i] < 0.02 || r.series.hub_travel_m[i] >= 0.035) continue;
    sum += r.series.f_x_n[i];
    n += 1;
  }
  EXPECT_EQ(r.equal_travel.outputs[0].name, "f_x");
  EXPECT_NEAR(r.equal_travel.outputs[0].mean, sum / n, 1e-12);
  s.rig.travel.compare_to_hub_m = 0.2;  // farther than it goes
  EXPECT_TRUE(RunWheelTest(s, SmallTile(), nullptr).equal_travel.outputs.empty());
}

TEST(Travel, RulesStandWhereNothingIsSaid) {
  WheelTestSpec s = Small();
  EXPECT_DOUBLE_EQ(TravelOf(s).least_hub_m, 0.04);
  EXPECT_DOUBLE_EQ(TravelOf(s).compare_to_hub_m, 0.04);
  EXPECT_DOUBLE_EQ(TravelOf(s).compare_from_hub_m, 0.04 * 2 / 3);
  EXPECT_DOUBLE_EQ(DriveTime(s), 0.8);
  s.rig.max_time_s = 0;
  s.rig.travel.least_hub_m = 0.3;
  s.state.slip = 0.9;  // hub at 0.01 m/s
  EXPECT_NEAR(DriveTime(s), 1.25 * 30, 1e-9);
  s.state.slip = 1;  // and on the spot
  EXPECT_NEAR(DriveTime(s), 1.25 * 30, 1e-9);
  s.state.slip = -0.5;
  EXPECT_NEAR(DriveTime(s), 1.25 * 3, 1e-9);
  ValidateSpec(s);
  s.rig.travel.compare_from_hub_m = 0.4;
  EXPECT_THROW(ValidateSpec(s), SpecError);
}

TEST(Sinkage, CountsFromTheSurfaceOfTheBed) {
  WheelTestSpec s = Small();
  s.rig.max_time_s = 0.1;
  Tile at_cut = SmallTile();
  at_cut.surface_m = 0;
  const WheelTestResult a = RunWheelTest(s, SmallTile(), nullptr),
                        b = RunWheelTest(s, at_cut, nullptr);
  ASSERT_LT(SmallTile().surface_m, -1e-3);
  ASSERT_EQ(a.series.f_z_n, b.series.f_z_n);  // the same run
  for (std::size_t i = 0; i < a.series.time_s.size(); ++i) {
    EXPECT_NEAR(a.series.sinkage_m[i], b.series.sinkage_m[i] + SmallTile().surface_m, 1e-12);
  }
  for (std::size_t i = 0; i < a.surface.height_m.size(); ++i) {
    if (std::isnan(a.surface.height_m[i])) continue;
    EXPECT_NEAR(a.surface.height_m[i], b.surface.height_m[i] - SmallTile().surface_m, 1e-12);
  }
}

TEST(Overload, IsByRuleFromWheelAndBed) {
  WheelTestSpec s = Small();
  EXPECT_DOUBLE_EQ(MostSinkage(s), 0.05 - 2 * 0.012);
  s.rig.bed_depth_m = 0.2;
  EXPECT_DOUBLE_EQ(MostSinkage(s), 1.5 * 0.04);
  s.rig.most_sinkage_m = 0.05;
  EXPECT_DOUBLE_EQ(MostSinkage(s), 0.05);
  ValidateSpec(s);
  s.rig.most_sinkage_m = 0.061;  // the soil would close over the wheel
  EXPECT_THROW(ValidateSpec(s), SpecError);
}

TEST(Overload, IsNoMatterOfOneInstant) {
  WheelDrive d = {};
  d.dt_s = 0.01;
  d.radius_m = 0.04;
  d.surface_m = -0.004;
  d.most_sinkage_m = 0.03;
  d.deepest_m = 0.04;
  d.overload_s = 0.05;
  RigidBody wheel = {};
  WheelState s;
  const auto at = [&](double sinkage) {
    wheel.position_m = {0, 0, 0.04 - 0.004 - sinkage};
    return wheel_step::Overloaded(d, wheel, &s);
  };
  for (int k = 0; k < 4; ++k) EXPECT_FALSE(at(0.031)) << k;
  EXPECT_FALSE(at(0.029));  // it came back
  for (int k = 0; k < 4; ++k) EXPECT_FALSE(at(0.031)) << k;
  at(0.031);
  EXPECT_TRUE(at(0.031));
  s.deep_s = 0;
  EXPECT_TRUE(at(0.041));  // this deep it ends at once
}

TEST(Angles, AllThatAreMeasuredAreAccepted) {
  for (const double degrees : {0.0, 15.0, 45.0, 75.0, 90.0}) {
    for (const bool treads : {false, true}) {
      WheelTestSpec s = Small();
      s.rig.bed_width_m = 0.14;
      s.state.attack_angle_rad = degrees * M_PI / 180;
      s.state.slip = 0.1;
      if (treads) s.wheel.treads = {{.count = 12, .height_m = 0.005, .root_thickness_m = 0.003}};
      EXPECT_NO_THROW(ValidateSpec(s)) << degrees;
    }
  }
}

// Locked: it goes on where earlier runs ended, and the window carries what it pushes.
TEST(Overload, ALockedWheelGoesDeeperThan07Radii) {
  WheelTestSpec s = Small();
  s.rig.bed_depth_m = 0.10;
  s.rig.max_time_s = 0.8;
  s.rig.scene = ReducedDomain();
  s.state.slip = -1;
  s.state.load_n = 16;
  const Tile tile = PrepareBed(BedOf(s), nullptr);
  const WheelTestResult r = RunWheelTest(s, tile, nullptr);
  EXPECT_EQ(r.stopped, StopCause::kTimeUp) << r.reason;
  double deepest = 0;
  for (const double z : r.series.sinkage_m) deepest = std::max(deepest, z);
  EXPECT_GT(deepest, 0.7 * 0.04);
  EXPECT_LT(deepest, 1.5 * 0.04);
}

}  // namespace
}  // namespace grouser::dem
