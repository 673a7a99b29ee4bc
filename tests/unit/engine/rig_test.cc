// A small bed and a small wheel through the whole rig.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "dem_offline/engine/rig/report.h"
#include "dem_offline/engine/rig/wheel_test.h"
#include "tests/unit/engine/rig_testing.h"

namespace grouser::dem {
namespace {

double Mean(const WheelTestResult& r, const std::string& name) {
  for (const auto& o : r.outputs) {
    if (o.name == name) return o.mean;
  }
  ADD_FAILURE() << name << " is missing";
  return 0;
}

double Error(const WheelTestResult& r, const std::string& name) {
  for (const auto& o : r.outputs) {
    if (o.name == name) return o.standard_error;
  }
  ADD_FAILURE() << name << " is missing";
  return 0;
}

TEST(Rig, TileIsFlatDenseAndRepeats) {
  const Tile& t = SmallTile();
  EXPECT_GT(t.radius_m.size(), 300u);
  EXPECT_GT(t.coordination, 3.5);
  for (std::size_t i = 0; i < t.radius_m.size(); ++i) {
    const double top = t.position[3 * i + 2] / 4294967296.0 * 1.0 + t.radius_m[i];
    EXPECT_LT(top, 0.001);  // nothing stands out of the cut plane
  }
  const Tile again = PrepareTile(Small(), nullptr);
  EXPECT_EQ(t.position, again.position);
  EXPECT_EQ(t.contact_history, again.contact_history);
  WheelTestSpec other = Small();
  other.seed = 2;
  EXPECT_NE(PrepareTile(other, nullptr).position, t.position);
}

TEST(Rig, CarriesTheLoadAndBooksTheEnergy) {
  const WheelTestResult r = RunWheelTest(Small(), SmallTile(), nullptr);
  ASSERT_TRUE(r.status == RunStatus::kSteady || r.status == RunStatus::kUnsteady) << r.reason;
  EXPECT_NEAR(Mean(r, "f_z"), 6, 0.6);
  EXPECT_GT(Mean(r, "torque"), 0);
  EXPECT_GT(Mean(r, "sinkage"), 0);
  EXPECT_NEAR(Mean(r, "slip"), 0.3, 1e-9);
  EXPECT_EQ(r.blocks, 8);
  EXPECT_GT(r.energy.input_j, 0);
  EXPECT_GT(r.energy.slip_j, 0);
  EXPECT_LT(std::abs(r.energy.residual_j), 1e-3 * r.energy.input_j);
  // The recorded stresses carry the vertical force.
  double carried = 0;
  const auto& p = r.stress;
  const double area = 0.04 * p.angle_step_rad * 0.04 / p.width_bins;
  for (std::size_t i = 0; i < p.normal_pa.size(); ++i) {
    const double a =
        p.first_angle_rad + (static_cast<double>(i / p.width_bins) + 0.5) * p.angle_step_rad;
    carried += area * (p.normal_pa[i] * std::cos(a) + p.shear_tangential_pa[i] * std::sin(a));
  }
  EXPECT_GT(carried, 0.6 * 6);
  EXPECT_LT(carried, 1.15 * 6);
}

TEST(Rig, RepeatsBitwise) {
  WheelTestSpec s = Small();
  s.rig.max_time_s = 0.25;
  const auto a = RunWheelTest(s, SmallTile(), nullptr), b = RunWheelTest(s, SmallTile(), nullptr);
  EXPECT_EQ(a.series.f_x_n, b.series.f_x_n);
  EXPECT_EQ(a.series.sinkage_m, b.series.sinkage_m);
}

TEST(Rig, LateralForceOpposesLateralMotion) {
  WheelTestSpec s = Small();
  s.state.attack_angle_rad = 0.8;
  s.rig.max_time_s = 0.6;
  const auto left = RunWheelTest(s, SmallTile(), nullptr);
  EXPECT_LT(Mean(left, "f_y"), 0);
  EXPECT_GT(left.v_y_m_per_s, 0);
  s.state.attack_angle_rad = -0.8;
  const auto right = RunWheelTest(s, SmallTile(), nullptr);
  EXPECT_GT(Mean(right, "f_y"), 0);
}

TEST(Rig, LockedWheelBrakesAndTowedWheelRolls) {
  WheelTestSpec s = Small();
  s.rig.max_time_s = 0.6;
  s.state.slip = -1;
  const auto locked = RunWheelTest(s, SmallTile(), nullptr);
  EXPECT_LT(Mean(locked, "f_x"), 0);
  EXPECT_EQ(locked.rim_speed_m_per_s, 0);
  s.state.mode = RigMode::kTowed;
  const auto towed = RunWheelTest(s, SmallTile(), nullptr);
  EXPECT_NEAR(Mean(towed, "torque"), 0, 0.3 * 6 * 0.04);
  EXPECT_GT(towed.rim_speed_m_per_s, 0.02);
  // It is dragged along and lags behind, here within the noise of half a second.
  EXPECT_LT(Mean(towed, "f_x"), 0);
  EXPECT_LT(towed.slip, 3 * Error(towed, "slip"));
  s.state.mode = RigMode::kFreeSlip;
  const auto free = RunWheelTest(s, SmallTile(), nullptr);
  EXPECT_GT(free.v_x_m_per_s, 0);  // drives itself
  EXPECT_LT(free.slip, 0.95);
}

TEST(Rig, TooHeavyIsOverload) {
  WheelTestSpec s = Small();
  s.state.load_n = 400;
  const auto r = RunWheelTest(s, SmallTile(), nullptr);
  EXPECT_EQ(r.status, RunStatus::kOverload) << r.reason;
}

TEST(Rig, StopsWhenAsked) {
  int calls = 0;
  const auto r =
      RunWheelTest(Small(), SmallTile(), [&](double, const std::string&) { return ++calls < 3; });
  EXPECT_EQ(r.status, RunStatus::kFailed);
  EXPECT_EQ(r.reason, "stopped by caller");
}

TEST(Rig, RefusesBadSpecs) {
  WheelTestSpec s = Small();
  for (const double load : {-1.0, 0.0}) {  // 0: a wheel off the ground meets no soil
    s.state.load_n = load;
    EXPECT_THROW(ValidateSpec(s), std::invalid_argument) << load;
  }
  s = Small();
  s.state.slip = 3;
  EXPECT_THROW(ValidateSpec(s), std::invalid_argument);
  s = Small();
  s.soil.sizes[0].mass_fraction = 0.9;
  EXPECT_THROW(ValidateSpec(s), std::invalid_argument);
  s = Small();
  s.state.load_n = std::nan("");
  EXPECT_THROW(ValidateSpec(s), std::invalid_argument);
}

TEST(Rig, RefusesBadScenes) {
  const auto bad = [](void (*change)(SceneSettings*)) {
    WheelTestSpec s = Small();
    change(&s.rig.scene);
    EXPECT_THROW(ValidateSpec(s), std::invalid_argument);
  };
  bad([](SceneSettings* s) { s->window_ahead = 0.05; });
  bad([](SceneSettings* s) { s->freeze_box = 0.9; });
  bad([](SceneSettings* s) { s->freeze_speed = 0; });
  bad([](SceneSettings* s) { s->look_steps = 0; });
  bad([](SceneSettings* s) {
    s->bed = SceneBed::kWindow;
    s->window_length_m = 0.1;  // the wheel would stand on the seam
  });
  WheelTestSpec s = Small();
  s.rig.scene = OnlyWhatIsNeeded();
  ValidateSpec(s);
  s.rig.scene = EverythingSimulated();
  ValidateSpec(s);
}

/// The same wheel test with everything simulated and with what it needs.
TEST(Rig, WhatIsNeededGivesTheForcesOfTheWhole) {
  WheelTestSpec s = Small();
  s.rig.target_relative_error = 1e-6;
  WheelTestResult r[2];
  for (const bool lean : {false, true}) {
    s.rig.scene = lean ? OnlyWhatIsNeeded() : EverythingSimulated();
    r[lean] = RunWheelTest(s, SmallTile(), nullptr);
    EXPECT_TRUE(r[lean].status == RunStatus::kSteady || r[lean].status == RunStatus::kUnsteady)
        << r[lean].reason;
    EXPECT_EQ(r[lean].stopped, StopCause::kTimeUp);
    EXPECT_LT(EnergyError(r[lean].energy), 1e-3);
  }
  EXPECT_EQ(r[0].use.awake_particle_steps, r[0].use.particle_steps);
  EXPECT_LT(r[1].use.awake_particle_steps, 0.6 * r[0].use.awake_particle_steps);
  EXPECT_EQ(r[1].rules.size(), r[0].rules.size() + 1);  // of the seam
  // Four grains across: two tiles of this bed differ by 0.4 N, 0.01 N m and 1.5 mm.
  EXPECT_NEAR(Mean(r[1], "f_x"), Mean(r[0], "f_x"), 3 * 0.4);
  EXPECT_NEAR(Mean(r[1], "torque"), Mean(r[0], "torque"), 3 * 0.01);
  EXPECT_NEAR(Mean(r[1], "sinkage"), Mean(r[0], "sinkage"), 3 * 1.5e-3);
}

TEST(Rig, StopsWhenPreciseAndSaysSo) {
  WheelTestSpec s = Small();
  s.rig.max_time_s = 3;
  s.rig.target_relative_error = 0.3;
  s.rig.scene = OnlyWhatIsNeeded();
  const WheelTestResult r = RunWheelTest(s, SmallTile(), nullptr);
  EXPECT_EQ(r.status, RunStatus::kSteady) << r.reason;
  EXPECT_EQ(r.stopped, StopCause::kPrecise);
  EXPECT_GE(r.travel_m, r.contact_length_m);
  EXPECT_LT(r.series.time_s.back(), 2.9);
}

TEST(EnergyError, IsTheShareThatNobodyAccountsFor) {
  EnergyLedger e;
  EXPECT_EQ(EnergyError(e), 0);
  e.input_j = 2;
  e.slip_j = 1.5;
  e.residual_j = -0.1;
  EXPECT_DOUBLE_EQ(EnergyError(e), 0.05);
  e.rolling_j = 2.5;  // grains fell: more was dissipated than the rig put in
  EXPECT_DOUBLE_EQ(EnergyError(e), 0.025);
}

}  // namespace
}  // namespace grouser::dem
