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
  const Tile again = PrepareBed(BedOf(Small()), nullptr);
  EXPECT_EQ(t.position, again.position);
  EXPECT_EQ(t.contact_history, again.contact_history);
  WheelTestSpec other = Small();
  other.seed = 2;
  EXPECT_NE(PrepareBed(BedOf(other), nullptr).position, t.position);
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

// A quarter scales without rounding: the similar test is the same test.
TEST(Rig, RunsTheSimilarTestAtAQuarterOfGravity) {
  WheelTestSpec earth = Small(), quarter = Small();
  earth.rig.max_time_s = 0.25;
  quarter.rig.max_time_s = 0.5;
  quarter.rig.speed_m_per_s /= 2;
  quarter.soil.gravity_m_per_s2 /= 4;
  quarter.soil.youngs_modulus_pa /= 4;
  quarter.state.load_n /= 4;
  const Tile tile = PrepareBed(BedOf(quarter), nullptr);
  ASSERT_EQ(tile.position, SmallTile().position);
  const auto a = RunWheelTest(earth, SmallTile(), nullptr),
             b = RunWheelTest(quarter, tile, nullptr);
  ASSERT_EQ(a.steps, b.steps);
  ASSERT_EQ(a.series.sinkage_m.size(), b.series.sinkage_m.size());
  EXPECT_NEAR(a.series.sinkage_m.back(), b.series.sinkage_m.back(), 1e-5);
  EXPECT_NEAR(a.series.f_x_n.back(), 4 * b.series.f_x_n.back(), 1e-2);
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
  s.state.slip = 0;
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

TEST(Rig, FreeWheelIsSteadyUnderADrawbarItPullsAndElseLost) {
  WheelTestSpec s = Small();
  s.rig.max_time_s = 4;
  s.rig.target_relative_error = 0.1;
  s.rig.scene = ReducedDomain();
  s.state.mode = RigMode::kFreeSlip;
  s.state.slip = 0;
  s.state.drawbar_n = 0.25;  // from 0.5 N on it stands still on one bed of three
  const WheelTestResult pulls = RunWheelTest(s, SmallTile(), nullptr);
  EXPECT_EQ(pulls.status, RunStatus::kSteady) << pulls.reason;
  EXPECT_NEAR(Mean(pulls, "f_x"), 0.25, std::max(4 * Error(pulls, "f_x"), 0.03 * 6));
  EXPECT_GT(pulls.v_x_m_per_s, 0);
  for (const double drawbar : {6.0, 4.0, -12.0}) {
    s.state.drawbar_n = drawbar;
    const WheelTestResult lost = RunWheelTest(s, SmallTile(), nullptr);
    EXPECT_EQ(lost.status, RunStatus::kLost) << drawbar << " N: " << lost.reason;
    EXPECT_EQ(lost.stopped, StopCause::kLost);
    EXPECT_NE(lost.reason.find(drawbar > 0 ? "cannot pull" : "cannot hold"), std::string::npos);
  }
}

/// Forces of `a`, where `b` is the same run of a wheel that backs: f_x and torque change
/// sign, f_y and m_z have the signs given.
void ExpectReversed(const WheelTestResult& a, const WheelTestResult& b, double y, double z) {
  const double load = 6, moment = 6 * 0.04;
  ASSERT_EQ(a.series.time_s.size(), b.series.time_s.size());
  ASSERT_GE(a.series.time_s.size(), 18u);
  for (int i = 0; i < 18; ++i) {  // 100 steps: later on trajectories diverge
    EXPECT_NEAR(a.series.f_x_n[i], -b.series.f_x_n[i], 1e-3 * load) << i;
    EXPECT_NEAR(a.series.f_y_n[i], y * b.series.f_y_n[i], 1e-3 * load) << i;
    EXPECT_NEAR(a.series.f_z_n[i], b.series.f_z_n[i], 1e-3 * load) << i;
    EXPECT_NEAR(a.series.torque_n_m[i], -b.series.torque_n_m[i], 1e-3 * moment) << i;
    EXPECT_NEAR(a.series.m_z_n_m[i], z * b.series.m_z_n_m[i], 1e-3 * moment) << i;
    EXPECT_NEAR(a.series.sinkage_m[i], b.series.sinkage_m[i], 1e-3 * 0.04) << i;
  }
  EXPECT_NEAR(a.slip, -b.slip, 1e-9);
  EXPECT_NEAR(a.v_x_m_per_s, -b.v_x_m_per_s, 1e-9);
  EXPECT_NEAR(a.rim_speed_m_per_s, -b.rim_speed_m_per_s, 1e-9);
}

TEST(Rig, BackingWheelGivesTheForcesTurnedRound) {
  WheelTestSpec s = Small();
  s.rig.max_time_s = 0.1;
  for (const double slip : {0.3, -0.2}) {
    s.state.attack_angle_rad = 0;
    s.state.slip = slip;
    const auto ahead = RunWheelTest(s, SmallTile(), nullptr);
    s.state.attack_angle_rad = M_PI;
    s.state.slip = -slip;
    ExpectReversed(ahead, RunWheelTest(s, SmallTile(), nullptr), -1, 1);  // the same bed, turned
  }
}

TEST(Rig, BackingObliquelyMirrorsTheForcesInX) {
  WheelTestSpec s = Small();
  s.rig.max_time_s = 0.1;
  Tile tile = SmallTile();  // without its contacts, which the mirror would turn
  tile.contact_first.assign(tile.radius_m.size() + 1, 0);
  tile.contact_partner.clear();
  tile.contact_history.clear();
  Tile mirrored = tile;
  for (std::size_t i = 0; i < tile.radius_m.size(); ++i) {
    mirrored.position[3 * i + 1] =
        static_cast<std::int32_t>(0u - static_cast<std::uint32_t>(tile.position[3 * i + 1]));
    mirrored.velocity[3 * i + 1] = -tile.velocity[3 * i + 1];
    mirrored.spin[3 * i] = -tile.spin[3 * i];
    mirrored.spin[3 * i + 2] = -tile.spin[3 * i + 2];
  }
  s.state.attack_angle_rad = M_PI / 6;
  s.state.slip = 0.2;
  const auto ahead = RunWheelTest(s, tile, nullptr);
  s.state.attack_angle_rad = M_PI - M_PI / 6;
  s.state.slip = -0.2;
  ExpectReversed(ahead, RunWheelTest(s, mirrored, nullptr), 1, -1);
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

TEST(Rig, RefusesWhatAModeOrLawWouldIgnore) {
  const auto refuses = [](const char* field, void (*change)(WheelTestSpec*)) {
    WheelTestSpec s = Small();
    change(&s);
    try {
      ValidateSpec(s);
      ADD_FAILURE() << field;
    } catch (const std::invalid_argument& error) {
      EXPECT_EQ(std::string(error.what()).rfind(field, 0), 0u) << error.what();
    }
  };
  refuses("state.slip", [](WheelTestSpec* s) { s->state.mode = RigMode::kTowed; });
  refuses("state.slip", [](WheelTestSpec* s) { s->state.mode = RigMode::kFreeSlip; });
  refuses("state.attack_angle_rad", [](WheelTestSpec* s) {
    s->state = {.mode = RigMode::kFreeSlip, .attack_angle_rad = 0.5, .load_n = 6};
  });
  refuses("state.drawbar_n", [](WheelTestSpec* s) { s->state.drawbar_n = 1; });
  refuses("rig.target_relative_error", [](WheelTestSpec* s) { s->rig.target_relative_error = .3; });
  refuses("rig.scene.window_length_m",
          [](WheelTestSpec* s) { s->rig.scene.window_length_m = 0.3; });
  refuses("soil.grains.contact.surface_energy_j_per_m2",
          [](WheelTestSpec* s) { s->soil.contact.surface_energy_j_per_m2 = 0.1; });
  refuses("soil.grains.contact.capillary", [](WheelTestSpec* s) {
    s->soil.contact.settings = {{"capillary", "surface_tension_n_per_m", 0.07}};
  });
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
  s.rig.scene = ReducedDomain();
  ValidateSpec(s);
  s.rig.scene = FullDomain();
  ValidateSpec(s);
}

/// The same wheel test in the full and in the reduced domain.
TEST(Rig, ReducedDomainGivesTheForcesOfTheFull) {
  WheelTestSpec s = Small();
  s.rig.target_relative_error = 1e-6;
  WheelTestResult r[2];
  for (const bool reduced : {false, true}) {
    s.rig.scene = reduced ? ReducedDomain() : FullDomain();
    r[reduced] = RunWheelTest(s, SmallTile(), nullptr);
    EXPECT_TRUE(r[reduced].status == RunStatus::kSteady ||
                r[reduced].status == RunStatus::kUnsteady)
        << r[reduced].reason;
    EXPECT_EQ(r[reduced].stopped, StopCause::kTimeUp);
    EXPECT_LT(EnergyError(r[reduced].energy), 1e-3);
  }
  EXPECT_EQ(r[0].use.active_particle_steps, r[0].use.particle_steps);
  EXPECT_LT(r[1].use.active_particle_steps, 0.6 * r[0].use.active_particle_steps);
  EXPECT_EQ(r[1].rules.size(), r[0].rules.size() + 1);  // of the seam
  // Four grains across: two tiles of this bed differ by 0.4 N, 0.01 N m and 1.5 mm.
  EXPECT_NEAR(Mean(r[1], "f_x"), Mean(r[0], "f_x"), 3 * 0.4);
  EXPECT_NEAR(Mean(r[1], "torque"), Mean(r[0], "torque"), 3 * 0.01);
  EXPECT_NEAR(Mean(r[1], "sinkage"), Mean(r[0], "sinkage"), 3 * 1.5e-3);
}

TEST(Rig, StopsWhenPreciseAndSaysSo) {
  WheelTestSpec s = Small();
  s.rig.max_time_s = 3;
  s.rig.target_relative_error = 0.1;
  s.rig.scene = ReducedDomain();
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
