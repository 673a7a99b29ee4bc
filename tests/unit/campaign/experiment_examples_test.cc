// The examples in larger grains: seconds each, and physics that must hold in any grains.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>

#include "dem_offline/engine/experiment/experiment.h"
#include "dem_offline/scenes/experiment_joints_yaml.h"
#include "dem_offline/scenes/experiment_yaml.h"

namespace grouser::campaign {
namespace {

namespace dx = dem::experiment;
using Column = std::vector<double>;

struct Ran {
  dx::Result result;
  std::map<std::string, Column> series;
  const Column& operator[](const std::string& name) const { return series.at(name); }
};

/// The three sizes of a bed, 10 % apart.
std::vector<std::string> Sizes(double d, std::vector<std::string> more = {}) {
  for (int k = 0; k < 3; ++k) {
    more.push_back("grains.sizes[" + std::to_string(k) +
                   "].diameter_m=" + std::to_string((0.9 + 0.1 * k) * d));
  }
  return more;
}

Ran RunQuick(const std::string& example, const std::vector<std::string>& sets) {
  const auto file = LoadExperiment(
      (std::filesystem::path(GROUSER_EXPERIMENTS) / (example + ".yaml")).string(), {}, sets);
  Ran out;
  const auto sink = [&](const dx::Table& table, const std::vector<double>& row) {
    if (table.name != "series") return;
    for (std::size_t k = 0; k < row.size(); ++k) out.series[table.columns[k]].push_back(row[k]);
  };
  out.result = dx::RunExperiment(file.experiment, sink, nullptr);
  EXPECT_TRUE(out.result.done) << out.result.reason;
  return out;
}

/// Mean of y where x is in [low, high].
double MeanWhere(const Column& x, const Column& y, double low, double high) {
  double sum = 0, n = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (x[k] < low || x[k] > high) continue;
    sum += y[k];
    n += 1;
  }
  EXPECT_GT(n, 0);
  return sum / n;
}

TEST(ExperimentExamples, PlateSinksAsBekkerSays) {
  const Ran run =
      RunQuick("plate", Sizes(0.012, {"probes=[{kind: pose, body: plate}, {kind: wrench, body: "
                                      "plate}, {kind: energy}]"}));
  const Column &z = run["plate.sinkage_m"], &f = run["plate.f_z_n"];
  // Pressure grows with sinkage as k z^n, n between 0.3 and 2 (Bekker 1969: 0.3 to 1.3 for soils).
  // Above the depth of one grain, 12 mm, the plate stands on single grains.
  const double p1 = MeanWhere(z, f, 0.012, 0.016), p2 = MeanWhere(z, f, 0.032, 0.038);
  EXPECT_GT(p1, 0);
  const double n = std::log(p2 / p1) / std::log(35 / 14.0);
  EXPECT_GT(n, 0.3);
  EXPECT_LT(n, 2);
  // What the plate does on the grains is the integral of the wrench over its way.
  double work = 0;
  for (std::size_t k = 1; k < z.size(); ++k) work += f[k] * (z[k] - z[k - 1]);
  const double booked = run["energy.body_work_j"].back() - run["energy.body_work_j"].front();
  EXPECT_NEAR(work, booked, 0.03 * booked);
  EXPECT_LT(std::abs(run["energy.residual_j"].back()), 0.02 * booked);
}

TEST(ExperimentExamples, WheelCarriesItsLoad) {
  const Ran run = RunQuick("wheel_press", Sizes(0.013));
  const Column &t = run["time_s"], &f = run["wheel.f_z_n"], &x = run["wheel.x_m"];
  // The end of the hold: the last samples before the wheel moves.
  std::size_t k = 0;
  while (k < x.size() && x[k] < 0.08 + 1e-6) ++k;
  EXPECT_NEAR(f[k - 2], 20, 0.2);
  EXPECT_NEAR(MeanWhere(t, f, t[k], t.back()), 20, 1);
  EXPECT_NEAR(x.back(), 0.16, 1e-6);
  EXPECT_NEAR(run["wheel.turned_y_rad"].back(), 114.6 * M_PI / 180 * 0.08 / 0.08, 1e-6);
  EXPECT_GT(run["wheel.sinkage_m"].back(), 0.001);
  // The soil turns against the drive.
  EXPECT_LT(MeanWhere(t, run["wheel.t_y_n_m"], t[k] + 0.2, t.back()), 0);
}

TEST(ExperimentExamples, RingShearsWithinCoulombsBound) {
  const Ran run = RunQuick("shear_ring", Sizes(0.011, {"grains.solid_fraction=0.59"}));
  const Column& turn = run["ring.turned_z_rad"];
  const double torque = -MeanWhere(turn, run["ring.t_z_n_m"], 0.3, 0.7),
               early = -MeanWhere(turn, run["ring.t_z_n_m"], 0.0, 0.02),
               force = MeanWhere(turn, run["ring.f_z_n"], 0.3, 0.7);
  EXPECT_NEAR(force, 16, 0.8);
  // Uniform pressure on the ring and c = 0: M = N tan(phi) 2/3 (R^3 - r^3)/(R^2 - r^2).
  const double arm = 2.0 / 3 * (0.06 * 0.06 * 0.06 - 0.03 * 0.03 * 0.03) / (0.0036 - 0.0009);
  const double friction = torque / (force * arm);
  RecordProperty("tan_phi", std::to_string(friction));
  EXPECT_GT(friction, 0.3);
  EXPECT_LT(friction, 1.0);
  EXPECT_LT(early, torque);
}

TEST(ExperimentExamples, ConeMeetsMoreResistanceTheDeeperItGoes) {
  const Ran run = RunQuick("cone", Sizes(0.011));
  const Column &z = run["cone.sinkage_m"], &f = run["cone.f_z_n"];
  const double upper = MeanWhere(z, f, 0.015, 0.03), lower = MeanWhere(z, f, 0.055, 0.07);
  EXPECT_GT(upper, 0);
  EXPECT_GT(lower, 1.5 * upper);
  // Sideways forces of a cone that goes straight down are small beside it.
  EXPECT_LT(std::abs(MeanWhere(z, run["cone.f_x_n"], 0.03, 0.07)), 0.3 * lower);
}

TEST(ExperimentExamples, HeapIsSteeperWithMoreRollingFriction) {
  const auto heap = [](double rolling_friction) {
    return RunQuick("repose", {"grains.diameter_m=0.012", "grains.count=1000",
                               "interfaces=[{between: [sand, any], restitution: 0.5, friction: "
                               "0.5, rolling_friction: " +
                                   std::to_string(rolling_friction) + "}]"});
  };
  const Ran low = heap(0.1), high = heap(0.4);
  const double flat = low["repose.angle_rad"].back(), steep = high["repose.angle_rad"].back();
  RecordProperty("angle_rad", std::to_string(flat) + ", " + std::to_string(steep));
  EXPECT_GT(flat, 0.1);
  EXPECT_GT(steep, 1.2 * flat);
  EXPECT_LT(steep, std::atan(0.5 + 0.4));  // slopes are not steeper than what holds a grain
  EXPECT_GT(high["repose.height_m"].back(), low["repose.height_m"].back());
  EXPECT_LT(low["kinetic_over_weight"].back(), 1e-5);
}

/// The fewer bonds are left the flatter the grain, and never more of them.
TEST(ExperimentExamples, BondedGrainBreaksUnderThePlate) {
  const Ran run = RunQuick("bonded_grain", {"grains.bonds.fragments=60", "grains.bonds.count=140",
                                            "grains.bonds.fragment_m=1.9e-4"});
  const Column &intact = run["bonds.intact"], &force = run["plate.f_z_n"];
  EXPECT_EQ(intact.front(), 140);
  EXPECT_TRUE(std::is_sorted(intact.rbegin(), intact.rend()));
  EXPECT_LT(intact.back(), 0.9 * 140);
  const double half = 0.5 * run["plate.z_m"].front() + 0.5 * run["plate.z_m"].back();
  EXPECT_GT(MeanWhere(run["plate.z_m"], force, 0, half),
            MeanWhere(run["plate.z_m"], force, half, 1));
}

TEST(ExperimentExamples, RigDrivesItsWheelAndLiftsIt) {
  if (!JointMechanism()) GTEST_SKIP() << "built without Simbody";
  const Ran run = RunQuick("joints", {"grains.diameter_m=0.016", "grains.count=450"});
  const Column &t = run["time_s"], &lift = run["wheel.f_z_n"];
  const double carriage = 7800 * 0.04 * 0.04 * 0.02 * 9.81,
               hub = (1.5 + 7800 * 0.02 * 0.02 * 0.02) * 9.81;
  // At rest the ground, through wheel, spring and rail, carries all of it.
  const double ground = MeanWhere(t, lift, 0.3, 0.4);
  EXPECT_GT(ground, 0.3 * hub);
  EXPECT_NEAR(ground + MeanWhere(t, run["rail.f_z_n"], 0.3, 0.4), hub + carriage, 0.02 * hub);
  EXPECT_NEAR(ground + MeanWhere(t, run["suspension.force_n"], 0.3, 0.4), hub, 0.02 * hub);
  // Driven: half of each ramp is lost; the rail pushes against what the soil does.
  EXPECT_NEAR(run["rail.way_m"].back(), 0.08, 1e-4);
  EXPECT_NEAR(run["axle.angle_rad"].back(), 114.6 * M_PI / 180, 1e-3);
  const double drag = MeanWhere(t, run["wheel.f_x_n"], 0.6, 1.3);
  EXPECT_LT(drag, 0);
  EXPECT_NEAR(MeanWhere(t, run["rail.f_x_n"], 0.6, 1.3), -drag, 0.02 * hub);
  EXPECT_NEAR(
      MeanWhere(t, run["axle.t_y_n_m"], 0.6, 1.3) + MeanWhere(t, run["wheel.t_y_n_m"], 0.6, 1.3), 0,
      0.01 * 0.05 * hub);
  // Lifted: the spring and its actuator carry hub and wheel.
  EXPECT_EQ(lift.back(), 0);
  EXPECT_LT(run["wheel.sinkage_m"].back(), -0.01);
  EXPECT_NEAR(MeanWhere(t, run["suspension.force_n"], 2.3, 2.4), hub, 0.1 * hub);
  for (const char* joint : {"rail", "column", "axle"}) {
    for (const double gap : run[joint + std::string(".gap_m")]) ASSERT_LT(gap, 1e-8) << joint;
  }
}

}  // namespace
}  // namespace grouser::campaign
