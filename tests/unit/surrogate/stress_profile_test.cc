// Recorded stress profiles: their signs, their mirror, what they add to a fit.
#include "surrogate/fit/stress_profile.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include "surrogate/fit/bekker_fit.h"
#include "surrogate/fit/fit_model.h"
#include "surrogate/fit/profile_report.h"
#include "tests/unit/surrogate/synthetic.h"

namespace grouser::surrogate {
namespace {

using synthetic::RandomRuns;
using synthetic::Truth;

constexpr WheelGeometry kWheel{0.0625, 0.05};
constexpr double kStep = 0.0872664626;  // 5 degrees
constexpr int kBins = 72;

Canonical StateOf(const Sample& row) {
  return ToCanonical(row.motion.v_x, row.motion.v_y, row.motion.rim_speed);
}

// Adds the profile that the truth has: bin means of its stresses, as a wheel seen
// from the contact frame records them, each with noise of a share of the peak.
void AddProfile(const Truth& truth, double noise, std::uint64_t seed, v1alpha1::RunSummary* run) {
  const Sample row = MakeSample(*run);
  const BekkerModel model(truth.physics, kWheel);
  const Canonical state = StateOf(row);
  const double sinkage = model.SolveCanonical(state, row.load_n).value[kSinkage];
  const double mirror = state.sign_x < 0 ? -1 : 1;
  constexpr int kFine = 50;
  std::vector<double> normal(kBins), tangential(kBins);
  double peak = 0, shear = 0;
  for (int i = 0; i < kBins; ++i) {
    for (int k = 0; k < kFine; ++k) {
      const double angle = -M_PI + (i + (k + 0.5) / kFine) * kStep;
      const RimStress at = model.StressAt(state, sinkage, mirror * angle);
      normal[i] += at.normal / kFine;
      tangential[i] += mirror * at.tangential / kFine;
    }
    peak = std::max(peak, normal[i]);
    shear = std::max(shear, std::fabs(tangential[i]));
  }
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal_law(0, 1);
  auto* stress = run->mutable_stress();
  stress->set_first_angle_rad(-M_PI);
  stress->set_angle_step_rad(kStep);
  for (int i = 0; i < kBins; ++i) {
    const bool contact = normal[i] > 0;  // no grain, no noise
    stress->add_normal_pa(normal[i] + (contact ? noise * peak * normal_law(random) : 0));
    stress->add_shear_tangential_pa(tangential[i] +
                                    (contact ? noise * shear * normal_law(random) : 0));
  }
}

struct Recovery {
  double c1 = 0, c2 = 0, c3 = 0, n = 0, k = 0;  // rms errors; k relative
};

Recovery ErrorsOfFits(double weight) {
  constexpr int kTrials = 4;
  Recovery rms;
  for (int trial = 0; trial < kTrials; ++trial) {
    Truth truth;
    truth.noise = 0.03;
    truth.physics.c2 = 0.05;
    auto runs = RandomRuns(truth, 24, v1alpha1::RUN_ROLE_TRAIN, 70 + trial, 12, 30);
    for (std::size_t i = 0; i < runs.size(); ++i) AddProfile(truth, 0.15, 90 + i, &runs[i]);
    BekkerFitOptions options;
    options.unit_weight = truth.physics.unit_weight;
    options.profile_weight = weight;
    const BekkerParameters p =
        FitBekker(SamplesOf(runs, v1alpha1::RUN_ROLE_TRAIN), kWheel, options, nullptr).parameters;
    const BekkerParameters& t = truth.physics;
    rms.c1 += (p.c1 - t.c1) * (p.c1 - t.c1) / kTrials;
    rms.c2 += (p.c2 - t.c2) * (p.c2 - t.c2) / kTrials;
    rms.c3 += (p.c3 - t.c3) * (p.c3 - t.c3) / kTrials;
    rms.n += (p.n - t.n) * (p.n - t.n) / kTrials;
    rms.k += std::pow(p.shear_modulus / t.shear_modulus - 1, 2) / kTrials;
  }
  return {std::sqrt(rms.c1), std::sqrt(rms.c2), std::sqrt(rms.c3), std::sqrt(rms.n),
          std::sqrt(rms.k)};
}

TEST(StressProfile, TellsWhatTotalsCannot) {
  const Recovery totals = ErrorsOfFits(0), both = ErrorsOfFits(1);
  std::printf("rms errors, totals alone: c1 %.3f c2 %.3f c3 %.3f n %.3f K %.2f\n", totals.c1,
              totals.c2, totals.c3, totals.n, totals.k);
  std::printf("with profiles:            c1 %.3f c2 %.3f c3 %.3f n %.3f K %.2f\n", both.c1, both.c2,
              both.c3, both.n, both.k);
  EXPECT_LT(both.c1, 0.5 * totals.c1);
  EXPECT_LT(both.c2, 0.5 * totals.c2);
  EXPECT_LT(both.c3, 0.5 * totals.c3);
  EXPECT_LT(both.n, 0.7 * totals.n);
  EXPECT_LT(both.k, 0.7 * totals.k);
}

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
  for (int i = 0; i < kBins; ++i) {
    none.mutable_stress()->set_normal_pa(i, 0);
    none.mutable_stress()->set_shear_tangential_pa(i, 0);
  }
  EXPECT_EQ(ErrorOf(none), "");
  EXPECT_FALSE(HasProfile(none));
}

TEST(StressProfile, WithoutOneOrWithoutWeightTheFitIsThatOfTotals) {
  Truth truth;
  truth.noise = 0.02;
  truth.misfit = 0.05;
  const auto bare = RandomRuns(truth, 16, v1alpha1::RUN_ROLE_TRAIN, 8, 12, 30);
  auto runs = bare;
  Truth other = truth;
  other.physics.c1 = 0.6;
  for (auto& run : runs) AddProfile(other, 0, 1, &run);
  BekkerFitOptions with, without;
  without.profile_weight = 0;
  const auto fit = [&](const std::vector<v1alpha1::RunSummary>& from, const BekkerFitOptions& o) {
    return FitBekker(SamplesOf(from, v1alpha1::RUN_ROLE_TRAIN), kWheel, o, nullptr).parameters;
  };
  const BekkerParameters totals = fit(bare, with);
  EXPECT_EQ(fit(bare, without).c1, totals.c1);
  EXPECT_EQ(fit(runs, without).c1, totals.c1);
  EXPECT_GT(fit(runs, with).c1, totals.c1 + 0.05);
  // The bekker kind looks at profiles, the hybrid does not.
  EXPECT_EQ(ProfileWeightOf(v1alpha1::MODEL_KIND_BEKKER), kProfileWeight);
  EXPECT_EQ(ProfileWeightOf(v1alpha1::MODEL_KIND_HYBRID), 0);
  runs.resize(8);
  FitRequest request = synthetic::MakeRequest(runs);
  const auto c1_of = [](const v1alpha1::Model& model) { return model.bekker().c1(); };
  const double hybrid = c1_of(FitModel(request));
  request.kind = v1alpha1::MODEL_KIND_BEKKER;
  const double bekker = c1_of(FitModel(request));
  request.profile_weight = 0;
  EXPECT_EQ(c1_of(FitModel(request)), hybrid);
  EXPECT_GT(bekker, hybrid + 0.02);
}

// The sign conventions of the DEM rig, on the committed campaign: what the rim
// carries is what the wheel carries, but for its closed sides.
TEST(StressProfile, RecordedStressesAddUpToTheRecordedForces) {
  const TrainingSet set = ReadRuns(GROUSER_PAIRS "/cmu-smooth-62.5-8mm/runs.json");
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

TEST(StressProfile, RepeatsShowTheNoiseOfAProfile) {
  Truth truth;
  const v1alpha1::RunSummary state = RandomRuns(truth, 1, v1alpha1::RUN_ROLE_PATCH, 5)[0];
  std::vector<v1alpha1::RunSummary> runs(40, state);
  for (std::size_t i = 0; i < runs.size(); ++i) AddProfile(truth, 0.1, 500 + i, &runs[i]);
  const std::vector<Sample> rows = ReplicateSamples(runs);
  const ProfileMisfit noise = RepeatMisfit(rows, kWheel);
  // 0.1 of the peak, in the bins in contact, over the rms of those bins.
  const RimProfile clean = MakeCompared(rows[0], kWheel).measured;
  double peak = 0, square = 0;
  int contact = 0;
  for (const double v : clean.normal) {
    peak = std::max(peak, v);
    square += v * v;
    contact += v != 0 ? 1 : 0;
  }
  const double expected = 0.1 * peak / std::sqrt(square / contact);
  EXPECT_NEAR(noise.normal, expected, 0.3 * expected);
  EXPECT_GT(noise.tangential, 0.5 * noise.normal);
  EXPECT_EQ(RepeatMisfit({rows[0]}, kWheel).normal, 0);
}

TEST(StressProfile, ReportsCompareRunsAndWeights) {
  Truth truth;
  truth.noise = 0.01;
  auto runs = RandomRuns(truth, 24, v1alpha1::RUN_ROLE_TRAIN, 18, 12, 30);
  for (auto& run : RandomRuns(truth, 6, v1alpha1::RUN_ROLE_TEST, 19, 12, 30)) runs.push_back(run);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (i != 26) AddProfile(truth, 0.1, 40 + i, &runs[i]);
  }
  runs[27].mutable_stress()->set_angle_step_rad(0.2 * kStep);  // carries a fifth of its load
  const std::vector<Sample> test = SamplesOf(runs, v1alpha1::RUN_ROLE_TEST);
  const auto profiles = CompareProfiles(test, BekkerModel(truth.physics, kWheel), 0);
  ASSERT_EQ(profiles.size(), 5u);
  EXPECT_EQ(std::count_if(profiles.begin(), profiles.end(), [](const auto& p) { return p.used; }),
            4);
  const ProfileMisfit misfit = PooledMisfit(profiles);
  EXPECT_LT(misfit.normal, 0.25);  // the noise
  EXPECT_LT(misfit.tangential, 0.35);
  EXPECT_THAT(ProfilesText(profiles, {0, 0}), testing::HasSubstr("not compared"));

  TrainingSet set;
  set.scene = synthetic::MakeScene();
  set.runs = runs;
  const auto trials = TryWeights(set, {0, 1});
  ASSERT_EQ(trials.size(), 2u);
  EXPECT_EQ(trials[0].left_out.runs, 24);
  EXPECT_EQ(trials[0].test.runs, 6);
  EXPECT_EQ(trials[0].test.profiles, 4);
  EXPECT_LT(trials[1].test.misfit.normal, trials[0].test.misfit.normal + 0.01);
  for (const WeightTrial& trial : trials) {
    EXPECT_NEAR(trial.parameters.c1, truth.physics.c1, 0.1);
    EXPECT_GT(trial.spread.c1, 1e-4);
    EXPECT_LT(trial.spread.c1, 0.1);
    EXPECT_LT(trial.spread.turn_speed, 1e-12);  // not fitted
  }
  EXPECT_THAT(WeightsText(trials, PatchOf(set)), testing::HasSubstr("friction_angle"));
  set.runs.resize(12);
  EXPECT_THROW(TryWeights(set, {0}), std::invalid_argument);
}

}  // namespace
}  // namespace grouser::surrogate
