// The shipped rows give the figures that docs/measured-vehicles.md states.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "surrogate/measured_vehicles/ways.h"
#include "surrogate/vehicle/vehicle_file.h"
#include "tests/unit/refusal.h"

namespace grouser::measured {
namespace {

using ::testing::HasSubstr;

const Comparison& Shipped() {
  static const Comparison comparison = Compare(
      {GROUSER_MEASURED "/drive_windows.csv", GROUSER_MEASURED "/borealtc_husky_power.csv", ""});
  return comparison;
}

const PowerSummary& On(const PowerComparison& c, const std::string& terrain) {
  for (const PowerSummary& s : c.terrains) {
    if (s.terrain == terrain) return s;
  }
  throw std::runtime_error(terrain);
}

TEST(MeasuredVehicles, YawRatesAreThoseCommitted) {
  const RobotYaw &husky = Shipped().robots[0], &warthog = Shipped().robots[1];
  ASSERT_EQ(husky.robot, "husky");
  EXPECT_EQ(husky.hard.windows, 201);
  EXPECT_NEAR(husky.hard.speed_ratio, 0.77, 0.01);
  EXPECT_NEAR(husky.hard.predicted_speed_ratio, 0.98, 0.02);
  EXPECT_NEAR(husky.soil.predicted_speed_ratio, 0.77, 0.02);
  EXPECT_EQ(husky.hard.left_out, 0);
  EXPECT_NEAR(husky.hard.factor_rms_all, 0.156, 0.001);  // the issue's own baseline
  EXPECT_NEAR(warthog.hard.factor_rms_all, 0.083, 0.001);
  EXPECT_NEAR(husky.hard.rms, 0.273, 0.003);
  EXPECT_NEAR(husky.soil.rms, 0.166, 0.003);
  EXPECT_NEAR(husky.soil.rms_moving, 0.100, 0.003);
  EXPECT_NEAR(warthog.hard.friction, 1.15, 0.03);
  EXPECT_NEAR(warthog.hard.rms, 0.080, 0.002);
  EXPECT_NEAR(husky.hard.repeat_rms, 0.154, 0.002);
  EXPECT_NEAR(warthog.hard.repeat_rms, 0.103, 0.002);
  for (const RobotYaw* r : {&husky, &warthog}) {
    EXPECT_EQ(r->hard.unbalanced, 0);
    EXPECT_GE(r->hard.covered, r->hard.band_low);
    EXPECT_LE(r->hard.covered, r->hard.band_high);
  }
}

TEST(MeasuredVehicles, PowerIsThatCommitted) {
  const PowerComparison& c = Shipped().power;
  EXPECT_NEAR(c.no_load_current_a, 2.10, 0.02);
  EXPECT_NEAR(On(c, "ICE").rms, 0.134, 0.003);
  EXPECT_NEAR(On(c, "ASPHALT").rms, 0.210, 0.003);
  EXPECT_NEAR(On(c, "FLOORING").rms, 0.518, 0.01);
  EXPECT_EQ(On(c, "SANDY_LOAM").ground, "Sandy loam 15 %");
  EXPECT_NEAR(On(c, "SANDY_LOAM").rms, 0.055, 0.005);
  EXPECT_NEAR(On(Shipped().rigid, "SANDY_LOAM").rms, 0.305, 0.01);
  EXPECT_NEAR(On(Shipped().all_soils, "SANDY_LOAM").rms, 0.386, 0.01);
  EXPECT_EQ(On(c, "SNOW").unanswered, 3);
  EXPECT_EQ(On(c, "ICE").rows, 17);
  EXPECT_NEAR(On(Shipped().rescaled, "SANDY_LOAM").yaw_rms, 0.015, 0.005);
  EXPECT_NEAR(On(Shipped().rescaled, "FLOORING").yaw_predicted -
                  On(Shipped().rescaled, "FLOORING").yaw_measured,
              0.020, 0.005);
  EXPECT_NEAR(c.current_ratio.middle, 1.59, 0.02);
  EXPECT_NEAR(Shipped().all_soils.current_ratio.middle, 1.92, 0.03);
  EXPECT_NEAR(c.measured_current_ratio, 1.448, 0.001);
  for (const PowerPoint& p : c.points) EXPECT_TRUE(p.motion != "stuck" && p.motion != "still");
}

// The same errors as those of the rows, from the cheapest way to the dearest.
TEST(MeasuredVehicles, WaysAreAsFarOffAsTheirRows) {
  const Comparison& c = Shipped();
  const std::vector<Way> ways = WaysOf(
      {GROUSER_MEASURED "/drive_windows.csv", GROUSER_MEASURED "/borealtc_husky_power.csv", ""}, c);
  ASSERT_EQ(ways.size(), 7U);
  const Way &factor = ways[0], &hard = ways[1], &table = ways[2], &law = ways[3], &draws = ways[5];
  for (const Way& way : ways) {
    EXPECT_GT(way.motion_us, 0) << way.name;
    EXPECT_EQ(way.robots.size(), 2U);
    EXPECT_EQ(way.power.size(), c.power.terrains.size());
    EXPECT_EQ(way.robots[0].rows, 100);
  }
  for (const int robot : {0, 1}) {
    const RobotYaw& r = c.robots[robot];
    EXPECT_NEAR(factor.robots[robot].yaw_rad_per_s, r.hard.factor_rms, 1e-9);
    EXPECT_NEAR(hard.robots[robot].yaw_rad_per_s, r.hard.rms, 1e-6);
    EXPECT_NEAR(law.robots[robot].yaw_rad_per_s, r.soil.rms, 1e-6);
    EXPECT_NEAR(draws.robots[robot].yaw_rad_per_s, r.hard.rms, 0.005);
    EXPECT_GE(draws.robots[robot].covered, 0);
  }
  for (std::size_t i = 0; i < c.power.terrains.size(); ++i) {
    const PowerSummary& s = c.power.terrains[i];
    const bool is_hard = !TerrainOf(s.terrain).hard.empty();
    if (is_hard) {
      EXPECT_NEAR(hard.power[i].share, s.rms, 1e-9) << s.terrain;
    }
    EXPECT_EQ(std::isnan(law.power[i].share), is_hard || s.terrain == "SNOW") << s.terrain;
    // The baseline of the aims: 57 to 373 %.
    EXPECT_GE(factor.power[i].share, 0.57) << s.terrain;
    EXPECT_LE(factor.power[i].share, 3.735) << s.terrain;
  }
  EXPECT_NEAR(table.power[3].share, law.power[3].share, 0.01);
  EXPECT_NEAR(factor.current_share, 1 - 1 / c.power.measured_current_ratio, 1e-9);
  const std::string text = TableOf(c, ways);
  EXPECT_EQ(std::ranges::count(text, '\n'), 9);
}

// A prediction that is met by construction is called held, one off by more is not.
TEST(MeasuredVehicles, VerdictsFollowTheTargets) {
  Comparison c = Shipped();
  c.robots[0].hard.rms = 0.119;
  EXPECT_TRUE(VerdictsOf(c)[0].held);
  c.robots[0].hard.rms = 0.121;
  EXPECT_FALSE(VerdictsOf(c)[0].held);
  c.robots[0].hard.covered = c.robots[0].hard.band_low - 1;
  EXPECT_FALSE(VerdictsOf(c)[1].held);
}

// Rows made by the solver itself: the friction that made them is found.
TEST(MeasuredVehicles, FitFindsTheFrictionThatMadeTheRows) {
  const auto& made = Shipped().robots[1].hard.points;
  std::vector<DriveWindow> windows;
  for (const YawPoint& p : made) {
    windows.push_back({"warthog", true, p.left_m_per_s, p.right_m_per_s, 0, 0, p.predicted});
  }
  const double friction = Shipped().robots[1].hard.friction;
  const vehicle::Vehicle v = [] {
    vehicle::Vehicle w;
    w.name = "warthog";
    w.mass_kg = 470;
    w.centre_z_m = 0.45;
    w.yaw_inertia_kg_m2 = 165;
    w.wheel_types = {{"tyre", 0.3, 0.25}};
    w.drives = {{"left", {}, {}}, {"right", {}, {}}};
    for (const double x : {0.457, -0.457}) {
      for (const int side : {0, 1}) {
        vehicle::Wheel wheel;
        wheel.name = std::to_string(w.wheels.size());
        wheel.x_m = x;
        wheel.y_m = side == 0 ? 0.54 : -0.54;
        wheel.drive = side;
        w.wheels.push_back(wheel);
      }
    }
    return w;
  }();
  const auto hard = surrogate::PublishedHardGrounds();
  const YawComparison c = CompareYaw(windows, "warthog", 1.08, "asphalt", [&](double mu) {
    surrogate::HardGround ground = FindHardGround(hard, "asphalt").ground;
    ground.friction = mu;
    return OnGround(v, ground);
  });
  EXPECT_NEAR(c.friction, friction, 0.005 * friction);
  EXPECT_LT(c.rms, 1e-3);
}

// A tyre sinks less than a rigid wheel and needs less torque; one on firm ground hardly any.
TEST(MeasuredVehicles, TyresRollEasierOnSoil) {
  std::ifstream table(GROUSER_SOILS);
  const auto soils = surrogate::ReadSoils(table, GROUSER_SOILS);
  int found = 0;
  for (const surrogate::Soil& soil : soils) {
    if (soil.name != "Sandy loam 15 %" && soil.name != "LETE sand") continue;
    const vehicle::Vehicle v =
        vehicle::ReadVehicle(std::string(GROUSER_VEHICLES) + "/husky.vehicle.yaml").vehicle;
    const vehicle::Solution rigid = OnGround(v, soil, Wheels::kRigid).Straight(0.5),
                            tyres = OnGround(v, soil, Wheels::kTyres).Straight(0.5);
    ASSERT_TRUE(rigid.balanced && tyres.balanced);
    EXPECT_LT(tyres.wheel[0].sinkage_m, rigid.wheel[0].sinkage_m);
    EXPECT_LT(TorqueOf(v, tyres, 0), 0.8 * TorqueOf(v, rigid, 0));
    EXPECT_GT(TorqueOf(v, tyres, 0), 0);
    ++found;
  }
  EXPECT_EQ(found, 2);
}

// Less current than rolling alone takes leaves nothing for the motor itself.
TEST(MeasuredVehicles, ANoLoadCurrentIsNotNegative) {
  std::ifstream table(GROUSER_SOILS);
  const PublishedGrounds grounds{surrogate::PublishedHardGrounds(),
                                 surrogate::ReadSoils(table, GROUSER_SOILS)};
  const vehicle::Vehicle v =
      vehicle::ReadVehicle(std::string(GROUSER_VEHICLES) + "/husky.vehicle.yaml").vehicle;
  const auto compare = [&](double concrete_a) {
    return ComparePloughed({concrete_a, 0.5, 1}, {9, 0.5, 1}, v, grounds, Wheels::kTyres);
  };
  const PloughedComparison plain = compare(6), little = compare(0.01);
  EXPECT_GT(plain.no_load_current_a, 0);
  EXPECT_EQ(little.no_load_current_a, 0);
  EXPECT_GT(little.ratio.low, 0);
}

TEST(MeasuredVehicles, MissingTablesAreNamed) {
  EXPECT_THAT(Refusal([] {
                Compare({"no-such.csv", "no-such.csv", ""});
              }),
              HasSubstr("no-such.csv: cannot be read"));
  EXPECT_THAT(Refusal([] {
                Compare({GROUSER_MEASURED "/drive_windows.csv",
                         GROUSER_MEASURED "/borealtc_husky_power.csv", "/no/such/folder"});
              }),
              HasSubstr("/no/such/folder: no file CONCRETE_*.csv"));
}

TEST(MeasuredVehicles, StraightSamplesAloneCount) {
  const StraightCurrent mean =
      MeanStraight({{0.5, 0.5, 3, 4}, {0.5, 0.8, 30, 40}, {0.05, 0.05, 30, 40}, {0.4, 0.42, 4, 5}});
  EXPECT_EQ(mean.samples, 2);
  EXPECT_DOUBLE_EQ(mean.current_a, 8);
}

}  // namespace
}  // namespace grouser::measured
