// Wheel tests side by side on the emulated device, against those of the CPU.
#include <gtest/gtest.h>

#include <cmath>

#include "dem_offline/engine/gpu/rig.h"
#include "tests/unit/engine/rig_testing.h"

namespace grouser::dem::gpu {
namespace {

WheelTestSpec Short(double slip, double attack_deg) {
  WheelTestSpec s = Small();
  s.rig.max_time_s = 0.5;
  s.state.slip = slip;
  s.state.attack_angle_rad = attack_deg * M_PI / 180;
  return s;
}

void ExpectSameRun(const WheelTestResult& a, const WheelTestResult& b) {
  EXPECT_EQ(a.status, b.status) << a.reason << "; " << b.reason;
  EXPECT_EQ(a.stopped, b.stopped);
  EXPECT_EQ(a.steps, b.steps);
  EXPECT_EQ(a.series.time_s, b.series.time_s);
  EXPECT_EQ(a.series.f_x_n, b.series.f_x_n);
  EXPECT_EQ(a.series.f_y_n, b.series.f_y_n);
  EXPECT_EQ(a.series.torque_n_m, b.series.torque_n_m);
  EXPECT_EQ(a.series.sinkage_m, b.series.sinkage_m);
  EXPECT_EQ(a.stress.normal_pa, b.stress.normal_pa);
  EXPECT_EQ(a.stress.shear_tangential_pa, b.stress.shear_tangential_pa);
  EXPECT_EQ(a.surface.height_m.size(), b.surface.height_m.size());
  EXPECT_EQ(a.use.particle_steps, b.use.particle_steps);
  const double scale = std::abs(b.energy.input_j);
  EXPECT_NEAR(a.energy.input_j, b.energy.input_j, 1e-9 * scale);
  EXPECT_NEAR(a.energy.slip_j, b.energy.slip_j, 1e-5 * scale);
  EXPECT_NEAR(a.energy.normal_damping_j, b.energy.normal_damping_j, 1e-5 * scale);
  EXPECT_NEAR(a.energy.residual_j, b.energy.residual_j, 1e-4 * scale);
}

TEST(EnsembleRig, RunsTheWheelTestsOfTheCpuBitByBit) {
  std::vector<WheelJob> jobs;
  jobs.push_back({Short(0.3, 0), &SmallTile()});
  jobs.push_back({Short(-0.2, 30), &SmallTile()});
  jobs.push_back({Short(0.0, 10), &SmallTile()});
  jobs[2].spec.state.mode = RigMode::kTowed;
  jobs.push_back({Short(0.0, 0), &SmallTile()});
  jobs[3].spec.state.mode = RigMode::kFreeSlip;
  jobs[3].spec.state.drawbar_n = 6;  // more than it pulls
  jobs[1].spec.wheel.treads = {{.count = 8, .height_m = 0.006, .root_thickness_m = 0.004}};
  const auto device = EmulatedDevice();
  std::vector<std::size_t> finished;
  double last = 0;
  const auto results = RunWheelTests(
      jobs, *device,
      [&](double share, const std::string&) {
        EXPECT_GE(share, last);
        last = share;
        return true;
      },
      [&](std::size_t n, const WheelTestResult&) { finished.push_back(n); });
  ASSERT_EQ(results.size(), 4u);
  EXPECT_EQ(finished.size(), 4u);
  for (std::size_t n = 0; n < jobs.size(); ++n) {
    ExpectSameRun(results[n], RunWheelTest(jobs[n].spec, SmallTile(), nullptr));
    EXPECT_GT(results[n].series.time_s.size(), n == 3 ? 100u : 400u);
  }
  EXPECT_EQ(results[3].status, RunStatus::kLost) << results[3].reason;
}

// Numbers that differ at the wheel and at the floor, other ones in either world.
TEST(EnsembleRig, KeepsTheNumbersOfEachInterfaceBitByBit) {
  WheelJob plain = {Short(0.3, 20), &SmallTile()};
  plain.spec.rig.max_time_s = 0.2;
  std::vector<WheelJob> jobs = {plain, plain, plain};
  InterfaceChoice& wheel = jobs[1].spec.soil.contact.wheel;
  wheel.rolling_damping = 1.0;
  wheel.settings = {{"hertz_restitution", "critical_damping_share", 0.9}};
  InterfaceChoice& floor = jobs[2].spec.soil.contact.floor;
  floor.rolling_damping = 0.05;
  floor.settings = {{"hertz_restitution", "critical_damping_share", 0.02}};
  const auto device = EmulatedDevice();
  const auto results = RunWheelTests(jobs, *device);
  for (std::size_t n = 0; n < jobs.size(); ++n) {
    SCOPED_TRACE(n);
    ExpectSameRun(results[n], RunWheelTest(jobs[n].spec, SmallTile(), nullptr));
    for (std::size_t m = 0; m < n; ++m) EXPECT_NE(results[n].series.f_z_n, results[m].series.f_z_n);
  }
}

TEST(EnsembleRig, FollowsFreezesAndOverloadsAsTheCpuDoes) {
  std::vector<WheelJob> jobs;
  jobs.push_back({Short(0.3, 0), &SmallTile()});
  jobs[0].spec.rig.scene.bed = SceneBed::kWindow;
  jobs[0].spec.rig.scene.freeze = true;
  jobs[0].spec.rig.scene.freeze_box = 1.25;
  jobs.push_back({Short(0.3, 0), &SmallTile()});
  jobs[1].spec.state.load_n = 400;  // sinks in
  const auto device = EmulatedDevice();
  const auto results = RunWheelTests(jobs, *device);
  const WheelTestResult cpu = RunWheelTest(jobs[0].spec, SmallTile(), nullptr);
  EXPECT_EQ(results[1].status, RunStatus::kOverload) << results[1].reason;
  EXPECT_EQ(results[1].steps, RunWheelTest(jobs[1].spec, SmallTile(), nullptr).steps);
  ASSERT_NE(results[0].status, RunStatus::kFailed) << results[0].reason;
  EXPECT_LT(results[0].use.active_particle_steps, results[0].use.particle_steps);
  EXPECT_NE(results[0].energy.frozen_j, 0);
  for (std::size_t k = 0; k < cpu.outputs.size(); ++k) {
    const OutputMean &a = results[0].outputs[k], &b = cpu.outputs[k];
    const double error = std::hypot(a.standard_error, b.standard_error);
    EXPECT_LE(std::abs(a.mean - b.mean), 4 * error + 1e-12) << a.name;
  }
}

TEST(EnsembleRig, StopsWhenAskedAndRefusesBySpec) {
  const auto device = EmulatedDevice();
  std::vector<WheelJob> jobs = {{Short(0.3, 0), &SmallTile()}};
  const auto stopped =
      RunWheelTests(jobs, *device, [](double, const std::string&) { return false; });
  EXPECT_EQ(stopped[0].stopped, StopCause::kCaller);
  EXPECT_EQ(stopped[0].status, RunStatus::kFailed);
  jobs.push_back(jobs[0]);
  jobs[1].spec.state.load_n = -1;
  try {
    RunWheelTests(jobs, *device);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("wheel test 1: "), std::string::npos);
  }
}

}  // namespace
}  // namespace grouser::dem::gpu
