// Recorded stress profiles: how they are read, their signs, their mirror.
#include "surrogate/fit/stress_profile.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "tests/unit/surrogate/made_profile.h"

namespace grouser::surrogate {
namespace {

using synthetic::AddProfile;
using synthetic::kWheel;
using synthetic::RandomRuns;
using synthetic::StateOf;
using synthetic::Truth;

TEST(StressProfile, OfAMirroredWheelIsThatOfItsTwin) {
  Truth truth;
  auto runs = RandomRuns(truth, 2, v1alpha1::RUN_ROLE_TRAIN, 3);
  v1alpha1::RunSummary ahead = runs[0], back = runs[0];
  ahead.set_slip(0.4);
  ahead.set_attack_angle_rad(0.3);
  back.set_slip(-0.4);
  back.set_attack_angle_rad(M_PI - 0.3);
  AddProfile(truth, 0, 1, &ahead);
  AddProfile(truth, 0, 1, &back);
  const Sample first = MakeSample(ahead), second = MakeSample(back);
  ASSERT_GT(first.motion.v_x, 0);
  ASSERT_LT(second.motion.v_x, 0);
  const RimProfile a = CanonicalProfile(first), b = CanonicalProfile(second);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_NEAR(a.first_rad, b.first_rad, 1e-6);
  double asymmetry = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(a.normal[i], b.normal[i], 1e-3);
    EXPECT_NEAR(a.tangential[i], b.tangential[i], 1e-3);
    asymmetry = std::max(asymmetry, std::fabs(a.normal[i] - a.normal[a.size() - 1 - i]));
  }
  EXPECT_GT(asymmetry, 1000);  // else the mirror would not show
  // Forces of the canonical profile are those of the canonical state.
  const auto value = BekkerModel(truth.physics, kWheel).SolveCanonical(StateOf(second), 20).value;
  const RimForces forces = ForcesOf(b, kWheel);
  EXPECT_NEAR(forces.f_z, value[kFz], 0.01 * 20);
  EXPECT_NEAR(forces.torque, value[kTorque], 0.01 * 20 * kWheel.radius_m);
}

TEST(StressProfile, ModelBinsAreMeansOfTheLawAndSmearKeepsTheForce) {
  Truth truth;
  auto runs = RandomRuns(truth, 1, v1alpha1::RUN_ROLE_TRAIN, 5);
  AddProfile(truth, 0, 1, &runs[0]);
  const Sample row = MakeSample(runs[0]);
  const BekkerModel model(truth.physics, kWheel);
  const RimProfile like = CanonicalProfile(row);
  const double z = model.SolveCanonical(StateOf(row), row.load_n).value[kSinkage];
  const RimProfile sharp = ModelProfile(model, StateOf(row), z, like, 0);
  const RimProfile smeared = ModelProfile(model, StateOf(row), z, like, 0.128);
  double sum = 0, sum_smeared = 0;
  int wider = 0;
  for (std::size_t i = 0; i < like.size(); ++i) {
    EXPECT_NEAR(sharp.normal[i], like.normal[i], 150);  // 4 points against 50, of 6 kPa
    EXPECT_NEAR(sharp.tangential[i], like.tangential[i], 150);
    sum += sharp.normal[i];
    sum_smeared += smeared.normal[i];
    wider += smeared.normal[i] > 0 && sharp.normal[i] == 0 ? 1 : 0;
  }
  EXPECT_NEAR(sum_smeared, sum, 1e-3 * sum);
  EXPECT_GE(wider, 1);
}

std::string ErrorOf(const v1alpha1::RunSummary& run) {
  try {
    MakeSample(run);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(StressProfile, ABrokenOneIsRefusedByName) {
  Truth truth;
  v1alpha1::RunSummary good = RandomRuns(truth, 1, v1alpha1::RUN_ROLE_TRAIN, 5)[0];
  EXPECT_FALSE(HasProfile(good));
  AddProfile(truth, 0, 1, &good);
  EXPECT_TRUE(HasProfile(good));
  EXPECT_EQ(ErrorOf(good), "");

  v1alpha1::RunSummary bad = good;
  bad.mutable_stress()->add_normal_pa(1);
  EXPECT_THAT(ErrorOf(bad), testing::HasSubstr("run " + bad.run_id() +
                                               ": stress: 73 normal and 72 tangential bins"));
  bad = good;
  bad.mutable_stress()->set_shear_tangential_pa(7, std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(ErrorOf(bad), testing::HasSubstr("stress.shear_tangential_pa[7]: nan, expected"));
  bad = good;
  for (const double step : {0.0, -0.1, std::numeric_limits<double>::quiet_NaN()}) {
    bad.mutable_stress()->set_angle_step_rad(step);
    EXPECT_THAT(ErrorOf(bad), testing::HasSubstr("stress.angle_step_rad: ")) << step;
  }
  bad.mutable_stress()->set_angle_step_rad(0.2);
  EXPECT_THAT(ErrorOf(bad), testing::HasSubstr("expected one turn at most"));
  bad = good;
  bad.mutable_stress()->set_first_angle_rad(std::numeric_limits<double>::infinity());
  EXPECT_THAT(ErrorOf(bad), testing::HasSubstr("stress.first_angle_rad: "));

  // A run that never came to a window recorded nothing: no profile, no error.
  v1alpha1::RunSummary none = good;
  for (int i = 0; i < synthetic::kBins; ++i) {
    none.mutable_stress()->set_normal_pa(i, 0);
    none.mutable_stress()->set_shear_tangential_pa(i, 0);
  }
  EXPECT_EQ(ErrorOf(none), "");
  EXPECT_FALSE(HasProfile(none));
}

// The sign conventions of the DEM rig, on the committed campaign: what the rim
// carries is what the wheel carries, but for its closed sides.
TEST(StressProfile, RecordedStressesAddUpToTheRecordedForces) {
  const TrainingSet set = ReadRuns(GROUSER_DENSE_PAIR "/runs.json");
  std::vector<Sample> rows = SamplesOf(set.runs, v1alpha1::RUN_ROLE_TRAIN);
  for (const auto role : {v1alpha1::RUN_ROLE_TEST, v1alpha1::RUN_ROLE_PATCH}) {
    for (const Sample& row : SamplesOf(set.runs, role)) rows.push_back(row);
  }
  int straight = 0;
  double f_x2 = 0, torque2 = 0, f_x_size = 0, torque_size = 0;
  for (const Sample& row : rows) {
    ASSERT_TRUE(HasProfile(*row.source));
    ASSERT_EQ(StateOf(row).sign_x, 1);  // no mirrored run among them
    const RimForces rim = ForcesOf(CanonicalProfile(row), kWheel);
    const double share = rim.f_z / row.mean[kFz];
    EXPECT_GT(share, 0.45) << row.source->run_id();
    EXPECT_LT(share, 1.02) << row.source->run_id();
    if (row.attack_angle_rad > M_PI / 4 + 1e-6) continue;  // the sides carry more and more
    ++straight;
    EXPECT_GT(share, 0.75) << row.source->run_id();
    const double f_x = (rim.f_x - row.mean[kFx]) / row.load_n;
    const double torque = (rim.torque - row.mean[kTorque]) / (row.load_n * kWheel.radius_m);
    f_x2 += f_x * f_x;
    torque2 += torque * torque;
    f_x_size += std::pow(row.mean[kFx] / row.load_n, 2);
    torque_size += std::pow(row.mean[kTorque] / (row.load_n * kWheel.radius_m), 2);
  }
  ASSERT_GE(straight, 40);
  // A sign turned round would be off by twice the size.
  const double f_x = std::sqrt(f_x2 / straight), torque = std::sqrt(torque2 / straight);
  RecordProperty("f_x_over_load", std::to_string(f_x));
  RecordProperty("torque_over_load_radius", std::to_string(torque));
  EXPECT_LT(f_x, 0.1);
  EXPECT_LT(f_x, 0.25 * std::sqrt(f_x_size / straight));
  EXPECT_LT(torque, 0.08);
  EXPECT_LT(torque, 0.25 * std::sqrt(torque_size / straight));
  RecordProperty("runs", straight);
  EXPECT_NEAR(GrainAngle(set.scene), 0.128, 1e-9);
}

}  // namespace
}  // namespace grouser::surrogate
