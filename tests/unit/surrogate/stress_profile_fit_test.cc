// What recorded stress profiles add to a fit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "surrogate/fit/bekker_fit.h"
#include "surrogate/fit/fit_model.h"
#include "surrogate/fit/profile_report.h"
#include "tests/unit/surrogate/made_profile.h"

namespace grouser::surrogate {
namespace {

using synthetic::AddProfile;
using synthetic::kStep;
using synthetic::kWheel;
using synthetic::RandomRuns;
using synthetic::Truth;

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
