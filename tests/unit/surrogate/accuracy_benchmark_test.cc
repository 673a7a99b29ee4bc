// Error rows, the kriging yardstick, and the accuracy benchmark of a pair from files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "surrogate/accuracy_benchmark/benchmark.h"
#include "surrogate/accuracy_benchmark/kriging.h"
#include "surrogate/accuracy_benchmark/on_measured.h"
#include "surrogate/accuracy_benchmark/targets.h"
#include "surrogate/fit/binomial_band.h"
#include "surrogate/fit/calibration.h"
#include "tests/unit/surrogate/synthetic.h"

namespace grouser::surrogate {
namespace {

namespace fs = std::filesystem;

double Choose(int n, int k) {
  double c = 1;
  for (int i = 0; i < k; ++i) c = c * (n - i) / (i + 1);
  return c;
}

TEST(BinomialBand, LeavesAtMostATailOfTwoAndAHalfPercent) {
  for (const int n : {1, 5, 12, 60, 200}) {
    const Band band = BinomialBand(n, 0.9);
    std::vector<double> p;
    for (int k = 0; k <= n; ++k)
      p.push_back(Choose(n, k) * std::pow(0.9, k) * std::pow(0.1, n - k));
    double below = 0, above = 0;
    for (int k = 0; k < band.low; ++k) below += p[k];
    for (int k = band.high + 1; k <= n; ++k) above += p[k];
    EXPECT_LE(below, 0.025) << n;
    EXPECT_LE(above, 0.025) << n;
    EXPECT_GT(below + p[band.low], 0.025) << n;  // no wider than that
    EXPECT_GT(above + p[band.high], 0.025) << n;
  }
}

Compared State(double slip, double angle, double load, double truth, double value, double half) {
  Compared j{slip, angle, load, {}, {}, {}};
  j.truth[kFx] = truth;
  j.value[kFx] = value;
  j.half_width[kFx] = half;
  return j;
}

const BenchmarkRow& RowOf(const std::vector<BenchmarkRow>& rows, const std::string& region) {
  for (const BenchmarkRow& r : rows) {
    if (r.region == region && r.output == "f_x") return r;
  }
  throw std::out_of_range(region);
}

TEST(MeasureErrors, CountsByRegionAsByHand) {
  // Errors 1, -2, 2 N at loads of 10, 20, 40 N.
  const std::vector<Compared> states = {State(-0.5, 0, 10, -3, -2, 1.5),
                                        State(0.3, 0.2, 20, 4, 2, 1.5),
                                        State(0.5, 1.2, 40, 5, 7, 2.5)};
  const auto rows = MeasureErrors({}, states, {0.1, 0, 0, 0, 0, 0}, 0.05);
  const BenchmarkRow& all = RowOf(rows, "all");
  EXPECT_EQ(all.n, 3);
  EXPECT_NEAR(all.rmse, std::sqrt((1 + 4 + 4) / 3.0), 1e-12);
  EXPECT_NEAR(all.noise_ratio, std::sqrt(9.0 / 3) / (0.1 * std::sqrt((100 + 400 + 1600) / 3.0)),
              1e-12);
  EXPECT_NEAR(all.r2, 1 - 9 / (25 + 4 + 9.0), 1e-12);  // mean 2
  EXPECT_NEAR(all.coverage90, 2.0 / 3, 1e-12);
  EXPECT_NEAR(all.p95_over_load, 0.1, 1e-12);
  EXPECT_EQ(RowOf(rows, "braking").n, 1);
  EXPECT_EQ(RowOf(rows, "driving").n, 1);
  EXPECT_EQ(RowOf(rows, "lateral").n, 1);
  EXPECT_EQ(RowOf(rows, "core").n, 1);
  EXPECT_THROW(RowOf(rows, "towed"), std::out_of_range);
}

TEST(MeasureErrors, RepeatsOfOneStateHaveNoR2) {
  std::vector<Compared> repeats(5, Compared{0.3, 0, 20, {}, {}, {}});
  for (std::size_t i = 0; i < repeats.size(); ++i) {
    repeats[i].truth[kFx] = 1 + 0.1 * static_cast<double>(i);
  }
  EXPECT_TRUE(std::isnan(MeasureErrors({}, repeats, {}, 1)[0].r2));
  repeats[1].slip = 0.4;
  repeats[2].slip = 0.5;
  EXPECT_FALSE(std::isnan(MeasureErrors({}, repeats, {}, 1)[0].r2));
}

TEST(MeasureErrors, WithoutIntervalsThereIsNoCoverage) {
  const auto rows = MeasureErrors({}, {State(0.3, 0, 10, 1, 2, 0)}, {}, 0.05);
  EXPECT_TRUE(std::isnan(RowOf(rows, "all").coverage90));
  EXPECT_TRUE(std::isnan(RowOf(rows, "all").noise_ratio));
  EXPECT_FALSE(RowOf(rows, "all").covered);
}

std::vector<v1alpha1::RunSummary> Runs(const synthetic::Truth& truth) {
  auto runs = synthetic::RandomRuns(truth, 60, v1alpha1::RUN_ROLE_TRAIN, 3, 10, 30);
  for (auto& r : synthetic::RandomRuns(truth, 25, v1alpha1::RUN_ROLE_TEST, 4, 10, 30)) {
    runs.push_back(r);
  }
  for (int k = 0; k < 4; ++k) {
    runs.push_back(synthetic::MakeRun(truth, "patch" + std::to_string(k), runs[5].slip(),
                                      runs[5].attack_angle_rad(), runs[5].load_n(),
                                      v1alpha1::RUN_ROLE_PATCH, 900 + k));
  }
  for (auto& r : runs) {
    r.set_wall_s(50);
    for (int o = 0; o < kOutputs; ++o) r.add_drift(0);
  }
  return runs;
}

synthetic::Truth NoisyTruth() {
  synthetic::Truth truth;
  truth.misfit = 0.15;
  truth.noise = 0.01;
  return truth;
}

TEST(Kriging, FollowsASmoothTruthAndKeepsItsMirrors) {
  const synthetic::Truth truth = NoisyTruth();
  const auto runs = Runs(truth);
  const auto train = SamplesOf(runs, v1alpha1::RUN_ROLE_TRAIN);
  const double radius = synthetic::MakeScene().wheel().radius_m();
  std::array<double, kOutputs> noise{};
  noise.fill(truth.noise);
  const Kriging kriging(train, noise, radius);
  std::vector<Compared> compared;
  for (const Sample& row : SamplesOf(runs, v1alpha1::RUN_ROLE_TEST)) {
    const Answer a = kriging.At(row);
    compared.push_back(
        {row.slip, row.attack_angle_rad, row.load_n, row.mean, a.value, a.half_width});
    Sample mirrored = row;
    mirrored.motion.v_y = -row.motion.v_y;
    const Answer b = kriging.At(mirrored);
    EXPECT_NEAR(b.value[kFx], a.value[kFx], 1e-9);
    EXPECT_NEAR(b.value[kFy], -a.value[kFy], 1e-9);
    EXPECT_NEAR(b.value[kMz], -a.value[kMz], 1e-9);
  }
  for (const BenchmarkRow& r : MeasureErrors({}, compared, noise, radius)) {
    if (r.region != "all" || r.output == "m_z") continue;
    EXPECT_GT(r.r2, 0.9) << r.output;
    EXPECT_LT(r.noise_ratio, 4) << r.output;
  }
}

v1alpha1::MeasuredPoint MeasuredNear(const Sample& run, double slip_off, double load_factor) {
  v1alpha1::MeasuredPoint p;
  p.set_slip(run.slip + slip_off);
  p.set_attack_angle_rad(run.attack_angle_rad);
  p.set_load_n(run.load_n * load_factor);
  for (int o = 0; o < kOutputs; ++o) p.add_value(o == kFx ? 1 : std::nan(""));
  return p;
}

TEST(OnMeasured, TakesRunsAtTheStatesAndNoOthers) {
  const auto runs = Runs(NoisyTruth());
  const auto train = SamplesOf(runs, v1alpha1::RUN_ROLE_TRAIN);
  const Sample& run = *std::ranges::max_element(train, {}, &Sample::slip);  // drives
  ASSERT_GT(run.slip, 0.1);
  const DemOnMeasured at =
      RunsAtStates({MeasuredNear(run, -0.001, 1), MeasuredNear(run, 0, 50)}, runs);
  ASSERT_EQ(at.compared.size(), 1u);
  EXPECT_EQ(at.compared[0].value[kFx], run.mean[kFx]);
  EXPECT_EQ(at.compared[0].truth[kFx], 1);
  EXPECT_NEAR(at.wall_s, run.source->wall_s(), 1e-9);
  BenchmarkRow head;
  head.reference = "measured";
  const auto rows = MeasureErrors(head, at.compared, {}, 0.0625);
  ASSERT_GE(rows.size(), 3u);  // f_x alone: all, and the groups that it is in
  EXPECT_EQ(rows[0].region, "all");
  EXPECT_EQ(rows[1].region, "braking <= 0.2, driving");
  EXPECT_NEAR(rows[1].rmse, std::fabs(run.mean[kFx] - 1), 1e-12);
  EXPECT_TRUE(std::isnan(rows[1].coverage90));  // a run has no interval for a measurement
}

TEST(OnMeasured, ReadsWhatValidateWrote) {
  const fs::path folder =
      fs::temp_directory_path() / ("grouser-validated-" + std::to_string(::getpid()));
  fs::create_directories(folder);
  const std::string file = (folder / "measured_dem_6mm.json").string();
  std::ofstream(file) << R"({"mean_diameter_m": 0.006, "rows": [
    {"slip": 0.2, "attack_angle_deg": 30, "load_n": 24, "measured": {"f_x": {"value": 1}},
     "dem": {"wall_s": 50, "outputs": {"f_x": {"value": 3}, "torque": {"value": 1}}}},
    {"slip": 0.2, "attack_angle_deg": 60, "load_n": 24, "measured": {"f_x": {"value": 1}},
     "dem": {"wall_s": null, "outputs": {}}}]})";
  EXPECT_EQ(ValidatedFiles(folder.string()), std::vector<std::string>{file});
  const DemOnMeasured dem = ReadValidated(file);
  EXPECT_EQ(dem.kind, "dem 6 mm");
  ASSERT_EQ(dem.compared.size(), 1u);
  EXPECT_EQ(dem.compared[0].value[kFx] - dem.compared[0].truth[kFx], 2);
  EXPECT_TRUE(std::isnan(dem.compared[0].truth[kTorque]));  // not measured
  EXPECT_EQ(dem.wall_s, 50);
  std::ofstream(file) << R"({"mean_diameter_m": 0.006, "rows": [
    {"slip": 0.2, "attack_angle_deg": 30, "load_n": 24, "measured": {"f_x": {"value": 1}},
     "dem": {"wall_s": null, "outputs": {"f_x": {"value": 3}}}}]})";
  const DemOnMeasured untimed = ReadValidated(file);
  EXPECT_EQ(untimed.compared.size(), 1u);
  EXPECT_TRUE(std::isnan(untimed.wall_s));  // told of none
  std::ofstream(file) << "{}";
  EXPECT_THAT([&] { ReadValidated(file); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("rows.json")));
  fs::remove_all(folder);
}

class PairTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("grouser-ladder-" + std::to_string(::getpid()));
    fs::create_directories(folder_ / "pair");
    TrainingSet set;
    set.name = "synthetic";
    set.scene = synthetic::MakeScene();
    set.runs = Runs(NoisyTruth());
    set.notes = {"/somewhere/runs/0123.run.h5: planned, not there"};
    WriteSummary((folder_ / "pair/runs.json").string(), set);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(PairTest, ASummaryKeepsWhatAFitNeeds) {
  const TrainingSet back = ReadRuns((folder_ / "pair/runs.json").string());
  const auto runs = Runs(NoisyTruth());
  ASSERT_EQ(back.runs.size(), runs.size());
  EXPECT_EQ(back.name, "synthetic");
  ASSERT_EQ(back.notes.size(), 1u);
  EXPECT_EQ(back.notes[0], "0123.run.h5: planned, not there");
  for (std::size_t k = 0; k < runs.size(); ++k) {
    EXPECT_EQ(back.runs[k].run_id(), runs[k].run_id());
    EXPECT_EQ(back.runs[k].role(), runs[k].role());
    EXPECT_EQ(back.runs[k].slip(), runs[k].slip());
    EXPECT_NEAR(back.runs[k].mean(kFx), runs[k].mean(kFx), 1e-6 * std::abs(runs[k].mean(kFx)));
  }
}

// The mean over its window is what a run that still drifts is good for; one without
// a window is good for nothing.
TEST(Rows, RunsThatDriftToTheirEndCount) {
  auto runs = Runs(NoisyTruth());
  const std::size_t all = SamplesOf(runs, v1alpha1::RUN_ROLE_TRAIN).size();
  runs[0].set_status(v1alpha1::RUN_STATUS_UNSTEADY);
  runs[1].set_status(v1alpha1::RUN_STATUS_UNSTEADY);
  runs[1].clear_drift();
  runs[2].set_status(v1alpha1::RUN_STATUS_UNSTEADY);
  runs[2].set_mean(kFx, std::nan(""));
  runs[3].set_status(v1alpha1::RUN_STATUS_OVERLOAD);
  const auto rows = SamplesOf(runs, v1alpha1::RUN_ROLE_TRAIN);
  EXPECT_EQ(rows.size(), all - 3);
  EXPECT_EQ(rows[0].source->run_id(), runs[0].run_id());
  EXPECT_FALSE(rows[0].steady);
  EXPECT_TRUE(rows[1].steady);
}

TEST_F(PairTest, BadSummariesAreRefusedWithTheirName) {
  const std::string file = (folder_ / "bad.json").string();
  std::ofstream(file) << "{\"runs\": [";
  EXPECT_THAT([&] { ReadRuns(file); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("bad.json")));
  EXPECT_THROW(FindPairs((folder_ / "nothing").string()), std::invalid_argument);
  EXPECT_THAT([&] { RunAccuracyBenchmark(FindPairs(folder_.string())[0], 0.01); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("bekker.model")));
}

TEST_F(PairTest, IsClimbedFromItsFiles) {
  FitPair((folder_ / "pair").string(), "test", false, [](const std::string&) {});
  const auto pairs = FindPairs(folder_.string());
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].name, "pair");
  const auto rows = RunAccuracyBenchmark(pairs[0], 0.01);
  const auto find = [&](const std::string& kind, const std::string& output) {
    for (const BenchmarkRow& r : rows) {
      if (r.kind == kind && r.output == output && r.region == "all") return r;
    }
    return BenchmarkRow{};
  };
  for (const char* kind : {"bekker", "lookup", "hybrid", "kriging"}) {
    EXPECT_EQ(find(kind, "f_x").n, 25) << kind;
    EXPECT_GT(find(kind, "f_x").ns_per_answer, 0) << kind;
  }
  // The misfit is beyond any Bekker model; the residual has it.
  EXPECT_LT(find("hybrid", "f_x").rmse, 0.7 * find("bekker", "f_x").rmse);
  EXPECT_GT(find("hybrid", "f_x").r2, 0.97);
  EXPECT_GT(find("lookup", "f_x").r2, 0.9);
  EXPECT_EQ(find("dem", "f_x").n, 5);  // four repeats and the training run itself
  EXPECT_NEAR(find("dem", "f_x").ns_per_answer, 50e9, 1);
  EXPECT_NE(BenchmarkJson(rows).find("\"kriging\""), std::string::npos);
  EXPECT_NE(BenchmarkMarkdown(rows, {}).find("| hybrid |"), std::string::npos);
  const auto targets = TargetsOf(rows, pairs[0]);
  const auto count = [&](const std::string& text) {
    return std::count_if(targets.begin(), targets.end(),
                         [&](const Target& t) { return t.what.find(text) != std::string::npos; });
  };
  EXPECT_EQ(count("rmse over patch noise"), 5);
  EXPECT_EQ(count("R2, all 25 states"), 4);
  EXPECT_EQ(count("cross-conformal"), 5);
  EXPECT_EQ(count("interval width"), 5);
  EXPECT_EQ(count("ns a state"), 3);
  EXPECT_GE(count("p95 over load"), 4);
}

// One row by hand, either side of each limit.
TEST(Targets, AreMetOrMissed) {
  BenchmarkRow row;
  row.pair = "p";
  row.kind = "hybrid";
  row.reference = "dem";
  row.output = "f_x";
  row.region = "all";
  row.n = 60;
  row.noise_ratio = 1.5;
  row.r2 = 0.96;
  row.coverage90 = 54.0 / 60;
  row.covered = true;
  row.width_sd = 4.5;
  row.ns_per_answer = 14;
  const auto targets = TargetsOf({row}, "p", {{{"f_x", 0.80}}, 60});
  ASSERT_EQ(targets.size(), 6u);
  EXPECT_TRUE(targets[0].Met());  // 1.5 <= 2, not 1.2
  EXPECT_FALSE(targets[0].Moonshot());
  EXPECT_FALSE(targets[1].Met());              // .96 < .97
  EXPECT_TRUE(targets[2].Met());               // in the band
  EXPECT_NEAR(targets[3].value, 0.05, 1e-12);  // (80 % of 60 + 90 % of 60)/120 = 85 %
  EXPECT_FALSE(targets[3].Met());
  EXPECT_FALSE(targets[4].Met());
  EXPECT_TRUE(targets[5].Moonshot());
}

}  // namespace
}  // namespace grouser::surrogate
