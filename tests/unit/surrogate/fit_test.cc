#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "surrogate/fit/bekker_fit.h"
#include "surrogate/fit/calibration.h"
#include "surrogate/fit/error_table.h"
#include "surrogate/fit/fit_model.h"
#include "surrogate/fit/gate.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/model_parts.h"
#include "surrogate/model_io/write_model.h"
#include "tests/unit/surrogate/synthetic.h"

namespace grouser::surrogate {
namespace {

using synthetic::MakeRequest;
using synthetic::MakeRun;
using synthetic::RandomRuns;
using synthetic::SmallCampaign;
using synthetic::Truth;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const v1alpha1::ErrorRow& Find(const v1alpha1::Model& model, const std::string& set,
                               const std::string& output) {
  for (const v1alpha1::ErrorRow& row : model.errors()) {
    if (row.set() == set && row.output() == output && row.region() == v1alpha1::REGION_ALL) {
      return row;
    }
  }
  throw std::runtime_error("no row " + set + " " + output);
}

HybridModel::Answer At(const v1alpha1::Model& model, double slip, double angle, double load) {
  const VelocityState v = FromSlip(slip, angle, 0.1);
  return MakeHybrid(model).EvaluateOne(v.v_x, v.v_y, v.rim_speed, load);
}

TEST(BekkerFit, RecoversParametersFromNoisyRuns) {
  Truth truth;
  truth.noise = 0.005;
  const auto runs = RandomRuns(truth, 60, v1alpha1::RUN_ROLE_TRAIN, 7, 12, 30);
  const std::vector<Sample> rows = SamplesOf(runs, v1alpha1::RUN_ROLE_TRAIN);
  BekkerFitOptions options;
  options.unit_weight = truth.physics.unit_weight;
  const BekkerParameters p = FitBekker(rows, {0.0625, 0.05}, options, nullptr).parameters;
  EXPECT_NEAR(p.n, truth.physics.n, 0.1);
  EXPECT_NEAR(p.friction_angle, truth.physics.friction_angle, 0.05);
  EXPECT_NEAR(p.shear_modulus, truth.physics.shear_modulus, 0.3 * truth.physics.shear_modulus);
  EXPECT_NEAR(p.sinkage_brake, truth.physics.sinkage_brake, 0.1);
  EXPECT_NEAR(p.side_passive, truth.physics.side_passive, 0.3 * truth.physics.side_passive);
}

TEST(FitModel, TwelveRunsOnOneLoadPredictHeldOutRuns) {
  Truth truth;
  truth.misfit = 0.05;
  truth.noise = 0.01;
  auto runs = SmallCampaign(truth, {24});
  ASSERT_EQ(runs.size(), 12u);
  for (auto& run : RandomRuns(truth, 40, v1alpha1::RUN_ROLE_TEST, 9, 24, 24)) runs.push_back(run);
  const v1alpha1::Model model = FitModel(MakeRequest(runs));
  EXPECT_NO_THROW(MakeModel(model));
  // Within the noise (0.24 N) and the misfit (1.2 N).
  EXPECT_LT(Find(model, "held_out", "f_x").rmse(), 1.2);
  EXPECT_LT(Find(model, "held_out", "f_y").rmse(), 1.2);
  EXPECT_LT(Find(model, "held_out", "sinkage").rmse(), 0.003);
  for (const char* output : {"f_x", "f_y", "torque", "sinkage"}) {
    EXPECT_GE(Find(model, "held_out", output).covered90(), 0.7) << output;
  }
  EXPECT_EQ(model.provenance().runs_size(), 52);
  EXPECT_GT(model.golden_size(), 10);
}

TEST(FitModel, IntervalsOfAManyRunModelCoverHeldOutRuns) {
  Truth truth;
  truth.misfit = 0.05;
  truth.noise = 0.015;
  auto runs = RandomRuns(truth, 40, v1alpha1::RUN_ROLE_TRAIN, 11, 12, 30);
  for (auto& run : RandomRuns(truth, 200, v1alpha1::RUN_ROLE_TEST, 12, 12, 30)) {
    runs.push_back(run);
  }
  for (int i = 0; i < 10; ++i) {
    runs.push_back(MakeRun(truth, "patch-" + std::to_string(i), 0.2, 0.3, 20,
                           v1alpha1::RUN_ROLE_PATCH, 5000 + i));
  }
  const v1alpha1::Model model = FitModel(MakeRequest(runs));
  for (const char* output : {"f_x", "f_y", "torque", "sinkage"}) {
    const v1alpha1::ErrorRow& row = Find(model, "held_out", output);
    EXPECT_EQ(row.n(), 200u);
    EXPECT_GE(row.covered90(), 0.80) << output;
    EXPECT_LE(row.covered90(), 0.99) << output;
  }
  // 2 % of misfit-free force would be 0.4 N; noise alone is 0.3 N.
  EXPECT_LT(Find(model, "held_out", "f_x").rmse(), 0.6);
  // The repeats' spread, not the standard errors, is the patch noise.
  const double middle = std::sqrt(model.domain().load_min_n() * model.domain().load_max_n());
  EXPECT_NEAR(model.sd_patch(kFx), 0.015 * middle, 0.008 * middle);
}

TEST(FitModel, ResidualTableBeatsPhysicsAlone) {
  Truth truth;
  truth.misfit = 0.1;
  truth.noise = 0.003;
  auto runs = RandomRuns(truth, 40, v1alpha1::RUN_ROLE_TRAIN, 21, 12, 30);
  for (auto& run : RandomRuns(truth, 60, v1alpha1::RUN_ROLE_TEST, 22, 12, 30)) runs.push_back(run);
  FitRequest request = MakeRequest(runs);
  const v1alpha1::Model hybrid = FitModel(request);
  request.kind = v1alpha1::MODEL_KIND_BEKKER;
  const v1alpha1::Model bekker = FitModel(request);
  EXPECT_EQ(bekker.residual().coefficients(kFx).values_size(), 0);
  for (const char* output : {"f_x", "f_y"}) {
    EXPECT_LT(Find(hybrid, "held_out", output).rmse(),
              0.6 * Find(bekker, "held_out", output).rmse())
        << output;
  }
}

// Physics of another world: what they leave of the runs is rougher than the runs.
Truth FarFromPhysics() {
  Truth truth;
  truth.misfit = 1.2;
  truth.noise = 0.003;
  return truth;
}

TEST(FitModel, WherePhysicsMisleadsTheTableIsTheAnswerNearRuns) {
  const Truth truth = FarFromPhysics();
  auto runs = RandomRuns(truth, 60, v1alpha1::RUN_ROLE_TRAIN, 71, 12, 30);
  for (auto& run : RandomRuns(truth, 60, v1alpha1::RUN_ROLE_TEST, 72, 12, 30)) runs.push_back(run);
  const v1alpha1::Model model = FitModel(MakeRequest(runs));
  ASSERT_GT(model.residual().coefficients(ResidualTable::kShare).values_size(), 0);
  EXPECT_LT(Find(model, "held_out", "f_x").rmse(), 0.04 * 20);
  EXPECT_LT(Find(model, "held_out", "f_y").rmse(), 0.04 * 20);
  const auto fast = MakeModel(model);  // golden vectors included
  const HybridModel law = MakeHybrid(model);
  for (const v1alpha1::RunSummary& run : runs) {
    const VelocityState v = FromSlip(run.slip(), run.attack_angle_rad(), 0.1);
    const auto at = law.EvaluateOne(v.v_x, v.v_y, v.rim_speed, run.load_n());
    const auto table = AnswerOf(*fast, v, run.load_n());
    for (const Output o : kPredicted) {
      const double scale = OutputScale(o, run.load_n(), 0.0625);
      EXPECT_NEAR(table.value[o], at.value[o], 4e-3 * scale) << run.run_id();
    }
    EXPECT_NEAR(at.value[kFz], run.load_n(), 1e-6 * run.load_n());
  }
  // Far from all runs physics alone answer.
  const VelocityState v = FromSlip(0.3, 0.4, 0.1);
  const auto heavy = law.EvaluateOne(v.v_x, v.v_y, v.rim_speed, 200);
  const auto physics = law.physics().Solve(v.v_x, v.v_y, v.rim_speed, 200);
  for (int o = 0; o < kOutputs; ++o) EXPECT_NEAR(heavy.value[o], physics.value[o], 1e-9);
  EXPECT_NE(heavy.flags & kExtrapolated, 0u);
  // And at motions that no run has: a rim that turns against the travel, at the runs' loads.
  for (const VelocityState& other : {VelocityState{0.05, 0, -0.1}, VelocityState{0.05, 0.03, -0.1},
                                     VelocityState{0.03, 0, -0.1}}) {
    const Canonical state = ToCanonical(other.v_x, other.v_y, other.rim_speed);
    EXPECT_NEAR(TrainedShare(model, state, 20), 0, 1e-3);
    const auto at = law.EvaluateOne(other.v_x, other.v_y, other.rim_speed, 20);
    const auto alone = law.physics().Solve(other.v_x, other.v_y, other.rim_speed, 20);
    for (const Output o : kPredicted) {
      EXPECT_NEAR(at.value[o], alone.value[o], 2e-3 * OutputScale(o, 20, 0.0625));
    }
  }
  for (const v1alpha1::RunSummary& run : runs) {
    if (run.role() != v1alpha1::RUN_ROLE_TRAIN) continue;
    const VelocityState of_run = FromSlip(run.slip(), run.attack_angle_rad(), 0.1);
    const Canonical state = ToCanonical(of_run.v_x, of_run.v_y, of_run.rim_speed);
    EXPECT_NEAR(TrainedShare(model, state, run.load_n()), 1, 1e-2) << run.run_id();
  }
}

TEST(FitModel, WherePhysicsLeadTheTableIsWhatTheyLeave) {
  Truth truth;
  truth.misfit = 0.05;
  truth.noise = 0.005;
  const v1alpha1::Model model = FitModel(MakeRequest(SmallCampaign(truth, {16, 24})));
  EXPECT_EQ(model.residual().coefficients(ResidualTable::kShare).values_size(), 0);
}

TEST(FitModel, RefitMovesTheAnswerTowardsTheNewRunAndNarrowsTheInterval) {
  Truth truth;
  truth.misfit = 0.08;
  truth.noise = 0.005;
  auto runs = SmallCampaign(truth, {24});
  for (auto& run : RandomRuns(truth, 20, v1alpha1::RUN_ROLE_TEST, 31, 24, 24)) runs.push_back(run);
  const v1alpha1::Model base = FitModel(MakeRequest(runs));
  // A state that the campaign left out, where the truth has a surprise.
  v1alpha1::RunSummary fresh =
      MakeRun(truth, "fresh", 0.5, 1.4, 24, v1alpha1::RUN_ROLE_TRAIN, 4242);
  fresh.set_mean(kFy, fresh.mean(kFy) - 2.5);
  runs.push_back(fresh);
  const v1alpha1::Model refit = FitModel(MakeRequest(runs));
  const auto before = At(base, 0.5, 1.4, 24), after = At(refit, 0.5, 1.4, 24);
  EXPECT_LT(std::fabs(after.value[kFy] - fresh.mean(kFy)),
            0.7 * std::fabs(before.value[kFy] - fresh.mean(kFy)));
  EXPECT_LT(after.sd_fit[kFx], before.sd_fit[kFx]);
  EXPECT_NE(before.flags & kExtrapolated, 0u);
  EXPECT_EQ(after.flags & kExtrapolated, 0u);
}

TEST(TrainingSet, RunsOfTwoEnginesCountSinkageFromOnePlane) {
  TrainingSet set;
  set.runs = RandomRuns(Truth(), 2, v1alpha1::RUN_ROLE_TRAIN, 5, 24, 24);
  const double before = set.runs[1].mean(kSinkage);
  set.runs[1].set_surface_m(-0.004);  // lies 4 mm under the cut plane
  TrainingSet alike = set;
  CountFromOnePlane(&set);
  EXPECT_NEAR(set.runs[1].mean(kSinkage), before + 0.004, 1e-12);
  EXPECT_FALSE(set.runs[1].has_surface_m());
  EXPECT_EQ(set.notes.size(), 1u);
  alike.runs[0].set_surface_m(-0.003);
  CountFromOnePlane(&alike);
  EXPECT_NEAR(alike.runs[1].mean(kSinkage), before, 1e-12);
  EXPECT_TRUE(alike.notes.empty());
}

TEST(FitModel, SaysWhatIsMissing) {
  auto runs = SmallCampaign(Truth(), {24});
  runs.resize(5);
  runs[0].set_status(v1alpha1::RUN_STATUS_UNSTEADY);
  runs[1].set_role(v1alpha1::RUN_ROLE_TEST);
  try {
    FitModel(MakeRequest(runs));
    FAIL() << "three runs are not enough";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(),
                testing::HasSubstr("3 steady training runs, at least 6 needed (besides: 1 steady "
                                   "runs held out or repeats, 1 not steady)"));
  }
  FitRequest request = MakeRequest(SmallCampaign(Truth(), {24}));
  request.set.scene.mutable_wheel()->set_radius_m(0);
  EXPECT_THROW(FitModel(request), std::runtime_error);
}

TEST(FitModel, OnlySteadyTrainingRunsMatter) {
  Truth truth;
  truth.noise = 0.01;
  auto runs = SmallCampaign(truth, {24});
  const v1alpha1::Model clean = FitModel(MakeRequest(runs));
  v1alpha1::RunSummary bad = runs[0];
  bad.set_run_id("bad");
  bad.set_mean(kFx, 200);  // far off, but no more than a wheel can meet
  bad.set_status(v1alpha1::RUN_STATUS_UNSTEADY);
  runs.push_back(bad);
  bad.set_run_id("held");
  bad.set_role(v1alpha1::RUN_ROLE_TEST);
  bad.set_status(v1alpha1::RUN_STATUS_STEADY);
  runs.push_back(bad);
  bad.set_status(v1alpha1::RUN_STATUS_OVERLOAD);
  bad.set_load_n(40);
  runs.push_back(bad);
  const v1alpha1::Model same = FitModel(MakeRequest(runs));
  EXPECT_EQ(clean.bekker().SerializeAsString().size(), same.bekker().SerializeAsString().size());
  EXPECT_EQ(At(clean, 0.3, 0.2, 24).value, At(same, 0.3, 0.2, 24).value);
  EXPECT_DOUBLE_EQ(same.domain().load_overload_n(), 40);
}

TEST(Gate, PassesAnHonestRefitAndStopsASpoiledOne) {
  Truth truth;
  truth.misfit = 0.03;
  truth.noise = 0.01;
  auto runs = SmallCampaign(truth, {24});
  for (auto& run : RandomRuns(truth, 20, v1alpha1::RUN_ROLE_TEST, 41, 24, 24)) runs.push_back(run);
  const v1alpha1::Model base = FitModel(MakeRequest(runs));
  runs.push_back(MakeRun(truth, "fresh", 0.5, 0.8, 24, v1alpha1::RUN_ROLE_TRAIN, 4242));
  const v1alpha1::Model refit = FitModel(MakeRequest(runs));
  for (const GateResult& check : GateChecks(base, refit)) {
    EXPECT_TRUE(check.passed) << check.name << ": " << check.detail;
    EXPECT_THAT(check.detail, HasSubstr(fmt::format("{:.4g}, at ", check.value))) << check.name;
    EXPECT_THAT(check.detail, HasSubstr(fmt::format(" {:.4g}: ", check.limit))) << check.name;
  }

  // Each limit is obeyed.
  const auto failing = [&](const v1alpha1::Model& candidate, const GateLimits& limits) {
    std::vector<std::string> names;
    for (const GateResult& check : GateChecks(base, candidate, limits)) {
      if (!check.passed) names.push_back(check.name);
    }
    return names;
  };
  GateLimits strict;
  strict.change_intervals = 1e-6;
  EXPECT_THAT(failing(refit, strict), ElementsAre("change", "domain_change"));
  strict.change_share = 0;
  EXPECT_THAT(failing(refit, strict), ElementsAre("change"));
  strict = {};
  strict.rmse_factor = strict.patch_share = 0;
  EXPECT_THAT(failing(refit, strict), ElementsAre("held_out"));

  // Without runs held out those of the base judge.
  v1alpha1::Model without[] = {base, refit};
  for (v1alpha1::Model& model : without) {
    for (v1alpha1::RunSummary& run : *model.mutable_provenance()->mutable_runs()) {
      if (run.role() == v1alpha1::RUN_ROLE_TEST) run.set_role(v1alpha1::RUN_ROLE_PATCH);
    }
  }
  const auto by_base = GateChecks(without[0], without[1]);
  EXPECT_TRUE(by_base[1].passed);
  EXPECT_THAT(by_base[1].detail, HasSubstr("runs of the base, as none is held out"));

  // New runs near everything leave nothing to judge by, which is no pass.
  v1alpha1::Model renamed = refit;
  for (v1alpha1::RunSummary& run : *renamed.mutable_provenance()->mutable_runs()) {
    if (run.role() == v1alpha1::RUN_ROLE_TRAIN) run.set_run_id("new " + run.run_id());
  }
  EXPECT_THAT(failing(renamed, {}), ElementsAre("domain_change"));

  v1alpha1::Model spoiled = refit;
  spoiled.mutable_bekker()->set_friction_angle_rad(0.05);
  const auto failed = [&](const std::string& name) {
    for (const GateResult& check : GateChecks(base, spoiled)) {
      if (check.name == name) return !check.passed;
    }
    return false;
  };
  EXPECT_TRUE(failed("self_test"));  // golden vectors no longer hold
  EXPECT_TRUE(failed("held_out"));
  EXPECT_TRUE(failed("change"));
  EXPECT_TRUE(failed("domain_change"));
  EXPECT_FALSE(failed("symmetry"));

  // A table that pushes the wheel for nothing is caught by its power.
  spoiled = refit;
  for (double& c : *spoiled.mutable_residual()->mutable_coefficients(kFx)->mutable_values()) {
    c = 3;
  }
  if (spoiled.residual().coefficients(kFx).values().empty()) {
    const int n = spoiled.residual().coefficients(ResidualTable::kDistance).values_size();
    auto* values = spoiled.mutable_residual()->mutable_coefficients(kFx)->mutable_values();
    for (int i = 0; i < n; ++i) values->Add(3);
  }
  EXPECT_TRUE(failed("dissipation"));

  // One that is less sure of its own domain.
  spoiled = refit;
  for (double& d : *spoiled.mutable_residual()
                        ->mutable_coefficients(ResidualTable::kDistance)
                        ->mutable_values()) {
    d = 1;
  }
  EXPECT_TRUE(failed("new_flags"));
}

TEST(Calibration, PatchNoiseFromRepeatsOrElseWidenedStandardErrors) {
  Truth truth;
  truth.noise = 0.02;
  std::vector<v1alpha1::RunSummary> runs;
  for (int i = 0; i < 50; ++i) {
    runs.push_back(MakeRun(truth, "repeat-" + std::to_string(i), 0.2, 0.1, 24,
                           v1alpha1::RUN_ROLE_PATCH, 900 + i));
  }
  const auto rows = SamplesOf(runs, v1alpha1::RUN_ROLE_PATCH);
  const BedVariability measured = EstimateBedVariability(rows, {}, 0.0625);
  EXPECT_EQ(measured.repeats, 49);
  EXPECT_NEAR(measured.sd[kFx], 0.02, 0.006);
  const BedVariability widened = EstimateBedVariability({}, rows, 0.0625);
  EXPECT_EQ(widened.repeats, 0);
  EXPECT_NEAR(widened.sd[kTorque], 0.03, 1e-9);
}

// Half of the folds miss wildly: intervals calibrated on all cover 90 % by
// construction, those calibrated without the fold do not know of it.
TEST(Calibration, CrossConformalCoverageIsNotByConstruction) {
  std::vector<Sample> rows(60);
  std::vector<LeftOut> left_out;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].load_n = 20;
    rows[i].mean = {};
    Prediction p{};
    const std::size_t fold = i / 5;  // 12 folds
    const double miss = 0.5 + 0.01 * static_cast<double>(i % 5);
    p.value[kFx] = fold == 3 ? 50 * miss : miss;
    left_out.push_back({&rows[i], p, fold});
  }
  BedVariability patch;
  patch.sd.fill(0.01);
  const auto share = CrossConformalCoverage(left_out, patch, 0.0625);
  const Calibration all = Calibrate(left_out, patch, 0.0625);
  int inside = 0;
  for (const LeftOut& l : left_out) {
    inside += std::fabs(l.prediction.value[kFx]) <= HalfWidth(all, patch, kFx, l, 0.0625);
  }
  EXPECT_GE(inside, 54);
  EXPECT_LT(share[kFx], 0.92);  // the odd fold is not covered by the others'
  EXPECT_GT(share[kFx], 0.7);
  EXPECT_EQ(share[kFy], 1);
}

// Left-out runs straight ahead and sideways, the latter off `more` times as much.
std::vector<LeftOut> LeftOutByDirection(double more, std::vector<Sample>* rows) {
  std::vector<LeftOut> left_out;
  rows->assign(200, Sample{});
  for (std::size_t i = 0; i < rows->size(); ++i) {
    Sample& row = (*rows)[i];
    const bool sideways = i % 2 == 1;
    row.load_n = 20;
    row.motion = sideways ? VelocityState{0, 0.1, 0} : VelocityState{0.1, 0, 0.1};
    Prediction p{};
    const double u = (static_cast<double>(i / 2) + 0.5) / 100;  // even quantiles
    p.value[kFy] = std::log(1 / u) * (i / 2 % 2 == 0 ? 1 : -1) * (sideways ? more : 1);
    left_out.push_back({&row, p, i % 12});
  }
  return left_out;
}

TEST(Calibration, WidensWhereWheelsBulldozeIfRunsAreFurtherOffThere) {
  std::vector<Sample> rows;
  BedVariability patch;
  patch.sd.fill(0.01);
  EXPECT_LT(EstimateBulldozing(LeftOutByDirection(1, &rows), patch, 0.0625)[kFy], 0.1);
  const auto left_out = LeftOutByDirection(3, &rows);
  patch.bulldozing = EstimateBulldozing(left_out, patch, 0.0625);
  EXPECT_NEAR(patch.bulldozing[kFy], 2, 0.3);
  EXPECT_EQ(patch.bulldozing[kFx], 0);  // no residual at all
  const Calibration calibration = Calibrate(left_out, patch, 0.0625);
  int straight = 0, sideways = 0;
  for (const LeftOut& l : left_out) {
    const bool inside =
        std::fabs(l.prediction.value[kFy]) <= HalfWidth(calibration, patch, kFy, l, 0.0625);
    (l.row->motion.v_y == 0 ? straight : sideways) += inside;
  }
  EXPECT_NEAR(straight, 90, 3);
  EXPECT_NEAR(sideways, 90, 3);
  const auto few = std::vector<LeftOut>(left_out.begin(), left_out.begin() + 29);
  EXPECT_EQ(EstimateBulldozing(few, patch, 0.0625)[kFy], 0);
}

TEST(Calibration, StudentQuantiles) {
  EXPECT_NEAR(StudentT95(5), 2.015, 0.01);
  EXPECT_NEAR(StudentT95(11), 1.796, 0.002);
  EXPECT_NEAR(StudentT95(1000), 1.646, 0.001);
}

}  // namespace
}  // namespace grouser::surrogate
