#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>

#include "proto/records/model_file.h"
#include "surrogate/fit/fit_model.h"
#include "surrogate/fit/json.h"
#include "surrogate/fit/measured.h"
#include "surrogate/fit/plausible.h"
#include "surrogate/fit/print.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/self_test.h"
#include "surrogate/model_io/write_model.h"
#include "tests/unit/surrogate/run_folder.h"

namespace grouser::surrogate {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using Files = synthetic::RunFolder;

TEST_F(Files, CampaignToModelToRefitWithProvenance) {
  synthetic::Truth truth;
  truth.noise = 0.01;
  auto runs = synthetic::SmallCampaign(truth, {24});
  for (auto& r : synthetic::RandomRuns(truth, 3, v1alpha1::RUN_ROLE_TEST, 5, 24, 24)) {
    runs.push_back(r);
  }
  for (const auto& run : runs) WriteRun(run);
  auto planned = runs;
  planned.emplace_back().set_run_id("never-ran");
  WriteCampaign(planned);

  const TrainingSet set = ReadCampaign(folder_.string());
  ASSERT_EQ(set.runs.size(), 15u);
  ASSERT_EQ(set.notes.size(), 1u);
  EXPECT_THAT(set.notes[0], HasSubstr("never-ran"));
  EXPECT_EQ(set.runs[14].role(), v1alpha1::RUN_ROLE_TEST);
  for (int o = 0; o < kOutputs; ++o) EXPECT_EQ(set.runs[4].mean(o), runs[4].mean(o));
  EXPECT_EQ(set.runs[0].sha256(),
            records::Sha256OfFile((folder_ / "runs" / set.runs[0].file()).string()));

  FitRequest request;
  request.name = "from-files";
  request.set = set;
  const v1alpha1::Model base = FitModel(request);
  const v1alpha1::RunSummary fresh =
      synthetic::MakeRun(truth, "fresh", 0.5, 1.4, 24, v1alpha1::RUN_ROLE_TRAIN, 77);
  const std::string file = WriteRun(fresh);
  const FitRequest again = RefitRequest(base, "base-digest", file);
  EXPECT_EQ(again.set.runs.size(), 16u);
  const v1alpha1::Model candidate = FitModel(again);
  EXPECT_EQ(candidate.provenance().base_digest(), "base-digest");
  const v1alpha1::RunSummary& last = candidate.provenance().runs(15);
  EXPECT_EQ(last.file(), "fresh.run.h5");
  EXPECT_EQ(last.sha256(), records::Sha256OfFile(file));
  EXPECT_EQ(candidate.name(), "from-files");
  EXPECT_THROW(RefitRequest(candidate, "d", file), std::runtime_error);  // known already

  const std::string json = ModelJson(candidate, "d");
  EXPECT_THAT(json, HasSubstr("fresh.run.h5"));
  EXPECT_THAT(ModelText(candidate, "d"), HasSubstr("held_out"));
}

TEST_F(Files, RefitRefusesAnUnsteadyOrForeignRun) {
  synthetic::Truth truth;
  truth.noise = 0.01;
  const v1alpha1::Model base =
      FitModel(synthetic::MakeRequest(synthetic::SmallCampaign(truth, {24})));
  v1alpha1::RunSummary fresh =
      synthetic::MakeRun(truth, "fresh", 0.5, 1.4, 24, v1alpha1::RUN_ROLE_TRAIN, 77);
  fresh.set_status(v1alpha1::RUN_STATUS_UNSTEADY);
  const std::string unsteady = WriteRun(fresh);
  EXPECT_THROW(RefitRequest(base, "d", unsteady), std::runtime_error);
  v1alpha1::Model other = base;
  other.mutable_wheel()->set_radius_m(0.1);
  fresh.set_status(v1alpha1::RUN_STATUS_STEADY);
  const std::string steady = WriteRun(fresh);
  EXPECT_THROW(RefitRequest(other, "d", steady), std::runtime_error);
  const std::size_t own = RefitRequest(base, "d", steady).set.runs.size();

  // What other refits of the base have, each run once; runs that they hold out stay out.
  v1alpha1::Model one = base, two = base;
  for (v1alpha1::Model* model : {&one, &two}) {
    *model->mutable_provenance()->add_runs() =
        synthetic::MakeRun(truth, "shared", 0.2, 1, 24, v1alpha1::RUN_ROLE_TRAIN, 78);
  }
  *two.mutable_provenance()->add_runs() = fresh;
  *two.mutable_provenance()->add_runs() =
      synthetic::MakeRun(truth, "kept", 0.3, 1, 24, v1alpha1::RUN_ROLE_TEST, 79);
  const FitRequest all = RefitRequest(base, "d", steady, {one, two});
  EXPECT_EQ(all.set.runs.size(), own + 1);
  EXPECT_EQ(all.set.runs.back().run_id(), "shared");
  other = base;
  other.set_name("another");
  EXPECT_THROW(RefitRequest(base, "d", steady, {other}), std::runtime_error);
}

TEST_F(Files, MeasuredTableIsReadAndMatched) {
  const std::string path = Write("m.csv",
                                 "# source\n"
                                 "slip,attack_angle_deg,load_n,f_x_n,f_x_sd,sinkage_m\n"
                                 "-0.1,0,24,-2.5,0.3,0.02\n"
                                 "0.25, 30,23,0.5,,\n"
                                 "0.6,60,22,1.5,0.1,0.03\n");
  const auto points = ReadMeasured(path, WheelLimits{0.0625});
  ASSERT_EQ(points.size(), 3u);
  EXPECT_DOUBLE_EQ(points[0].value(kFx), -2.5);
  EXPECT_TRUE(std::isnan(points[0].value(kFy)));
  EXPECT_TRUE(std::isnan(points[1].value(kSinkage)));
  EXPECT_NEAR(points[1].attack_angle_rad(), 0.5236, 1e-4);

  synthetic::Truth truth;
  truth.noise = 0.01;
  FitRequest request = synthetic::MakeRequest(synthetic::SmallCampaign(truth, {24}));
  request.measured = points;
  const v1alpha1::Model model = FitModel(request);
  EXPECT_TRUE(std::isfinite(model.sd_form(kFx)));
  EXPECT_TRUE(std::isnan(model.sd_form(kTorque)));  // not measured, never 0
  const auto rows = MatchMeasured(MakeHybrid(model), 0.1, points, request.set.runs);
  ASSERT_NE(rows[0].dem, nullptr);
  EXPECT_DOUBLE_EQ(rows[0].dem->slip(), -0.1);
  EXPECT_EQ(rows[2].dem, nullptr);  // slip 0.6: 0.1 from the nearest run
  const auto errors = MeasuredErrors(rows);
  ASSERT_FALSE(errors.empty());
  EXPECT_EQ(errors[0].n, 3);
  EXPECT_EQ(errors[0].n_dem, 2);
  EXPECT_THAT(MeasuredText(rows), HasSubstr("braking"));
  EXPECT_THAT(MeasuredJson(rows, "m"), HasSubstr("\"dem\":null"));
}

// What a run is refused for, with its id, file, output, value and range; "fits" if it is not.
TEST(CheckRuns, NamesTheRunThatCannotBe) {
  const synthetic::Truth truth;
  const auto said = [&](const std::function<void(v1alpha1::RunSummary*)>& change) {
    FitRequest request = synthetic::MakeRequest(synthetic::SmallCampaign(truth, {24}));
    change(&request.set.runs[5]);
    try {
      FitModel(request);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string("fits");
  };
  const std::string where = "run train-5 (train-5.run.h5)";
  const auto times = [](int o, double factor) {
    return [=](v1alpha1::RunSummary* run) { run->set_mean(o, factor * run->mean(o)); };
  };
  EXPECT_THAT(said(times(kFz, 1e-3)), HasSubstr(where + ": f_z: 0.024 N, expected 18 to 30 N"));
  EXPECT_THAT(said(times(kFz, 1e3)), HasSubstr(where + ": f_z: "));
  EXPECT_THAT(said(times(kFx, 1e3)), HasSubstr(where + ": f_x: "));
  EXPECT_THAT(said([](auto* run) { run->set_mean(kTorque, 2.3); }),
              HasSubstr(where + ": torque: 2.3 N m, expected -2.25 to 2.25 N m"));
  EXPECT_THAT(said([](auto* run) { run->set_mean(kMz, 20); }), HasSubstr(where + ": m_z: "));
  EXPECT_THAT(said([](auto* run) { run->set_mean(kSinkage, 0.13); }),
              HasSubstr(where + ": sinkage: 0.13 m, expected -0.00625 to 0.125 m"));
  EXPECT_THAT(said([](auto* run) { run->set_mean(kSinkage, -0.02); }),
              HasSubstr(where + ": sinkage: -0.02 m"));
  EXPECT_THAT(said([](auto* run) { run->set_mean(kFx, std::nan("")); }),
              HasSubstr("run train-5: f_x: expected a finite mean"));
  EXPECT_THAT(said([](auto* run) {
                for (const Output o : {kFx, kFy, kTorque}) run->set_mean(o, 1e-6 * run->mean(o));
              }),
              HasSubstr(where + ": f_x, f_y and torque/radius are at most"));
}

// A model that the server would refuse is not written, and what was there stays.
TEST_F(Files, WriteTestedModelLeavesTheOldFileWhereTheServerWouldRefuse) {
  synthetic::Truth truth;
  truth.noise = 0.01;
  v1alpha1::Model model = FitModel(synthetic::MakeRequest(synthetic::SmallCampaign(truth, {24})));
  const std::string path = Write("m.model", "old");
  const auto refuses = [&](const char* why) {
    try {
      WriteTestedModel(path, model);
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr("m.model: not written"), HasSubstr(why)));
    }
    std::ifstream file(path);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "old") << why;
  };
  const v1alpha1::Model good = model;
  model.mutable_golden(3)->set_value(kFx, 1 + model.golden(3).value(kFx));
  refuses("golden[3]");
  model = good;
  model.clear_golden();
  refuses("golden");
  model = good;
  model.mutable_domain()->set_load_max_n(-1);
  refuses("load");
  model = good;
  model.mutable_bekker()->set_c1(std::nan(""));
  refuses("c1");
  const std::string digest = WriteTestedModel(path, good);
  EXPECT_EQ(records::ReadModelFile(path).digest, digest);
}

TEST(Json, EscapesAndKeepsNaN) {
  const double nan = std::nan("");
  const Json json = {{"a\"b", nan}, {"c", {1, true, -HUGE_VAL}}, {"d", "line\n"}, {"e", "\xff"}};
  EXPECT_EQ(
      Text(json),
      "{\"a\\\"b\":\"NaN\",\"c\":[1,true,\"-Infinity\"],\"d\":\"line\\n\",\"e\":\"\xEF\xBF\xBD\"}")
      << "bytes that are no UTF-8 are replaced";
}

}  // namespace
}  // namespace grouser::surrogate
