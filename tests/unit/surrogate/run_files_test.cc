// Run files, their folders and summaries: what trains nothing, what is refused.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <filesystem>
#include <stdexcept>

#include "surrogate/fit/measured.h"
#include "surrogate/fit/plausible.h"
#include "tests/unit/surrogate/run_folder.h"

namespace grouser::surrogate {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using RunFiles = synthetic::RunFolder;

TEST_F(RunFiles, MeansOfNoStateAndLostRunsTrainNothing) {
  v1alpha1::RunSummary fresh =
      synthetic::MakeRun({}, "fresh", 0.5, 1.4, 24, v1alpha1::RUN_ROLE_TRAIN, 77);
  fresh.set_status(v1alpha1::RUN_STATUS_UNSTEADY);
  const std::string file = WriteRun(fresh);
  const auto rows = [&] {
    return SamplesOf({SummariseRun(file, v1alpha1::RUN_ROLE_TRAIN)}, v1alpha1::RUN_ROLE_TRAIN)
        .size();
  };
  EXPECT_EQ(rows(), 1u);  // drifted to its end
  records::RunFile run = records::ReadRunFile(file);
  run.record.set_means_of_no_state(true);
  records::WriteRunFile(file, run);
  EXPECT_EQ(rows(), 0u);
  run.record.set_means_of_no_state(false);
  run.record.set_status(v1alpha1::RUN_STATUS_LOST);
  records::WriteRunFile(file, run);
  EXPECT_EQ(rows(), 0u);
}

TEST_F(RunFiles, WhatASummaryHasIsNotMissingInAFolderThatWentOnFromIt) {
  const auto here = synthetic::MakeRun({}, "here", 0.1, 0, 24, v1alpha1::RUN_ROLE_TRAIN, 1);
  const auto before = synthetic::MakeRun({}, "before", 0.5, 0, 24, v1alpha1::RUN_ROLE_TEST, 2);
  const auto never = synthetic::MakeRun({}, "never", 0.7, 0, 24, v1alpha1::RUN_ROLE_TRAIN, 3);
  WriteRun(here);
  WriteCampaign({here, before, never});
  TrainingSet set = ReadCampaign(folder_);
  EXPECT_EQ(set.notes.size(), 2u);
  TrainingSet summary;
  summary.scene = set.scene;
  summary.runs = {before};
  Merge(summary, &set);
  EXPECT_EQ(set.runs.size(), 2u);
  ASSERT_EQ(set.notes.size(), 1u);
  EXPECT_THAT(set.notes[0], HasSubstr("never.run.h5: planned, not there"));
}

TEST_F(RunFiles, CampaignErrorsNameTheFile) {
  const auto complaint = [&] {
    try {
      ReadCampaign(folder_.string());
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(complaint(), AllOf(HasSubstr("campaign.json: cannot open"), HasSubstr("expected")));
  ASSERT_EQ(mkfifo((folder_ / "campaign.json").c_str(), 0600), 0);  // a reader that waits hangs
  EXPECT_THAT(complaint(), HasSubstr("campaign.json: not a regular file"));
  std::filesystem::remove(folder_ / "campaign.json");
  Write("campaign.json", "{\"runs\": [");
  EXPECT_THAT(complaint(), HasSubstr("not the JSON of a campaign"));
  WriteCampaign({synthetic::MakeRun({}, "broken", 0, 0, 24, v1alpha1::RUN_ROLE_TRAIN, 1)});
  Write("runs/broken.run.h5", "not HDF5");
  EXPECT_THAT(complaint(), HasSubstr("broken.run.h5"));
}

// All forces in kN beside a load in N: no single run need be impossible.
TEST(CheckRuns, RefusesACampaignWhoseForcesAreAllTooSmall) {
  TrainingSet set;
  set.scene = synthetic::MakeScene();
  set.runs = synthetic::SmallCampaign(synthetic::Truth(), {24});
  EXPECT_NO_THROW(CheckRuns(set));
  for (v1alpha1::RunSummary& run : set.runs) {
    for (const Output o : {kFx, kFy, kTorque}) run.set_mean(o, 1e-3 * run.mean(o));
  }
  EXPECT_THROW(CheckRuns(set), std::invalid_argument);
  for (v1alpha1::RunSummary& run : set.runs) run.set_status(v1alpha1::RUN_STATUS_FAILED);
  EXPECT_NO_THROW(CheckRuns(set));  // trains nothing
}

// The limits hold for every shipped campaign and measurement.
TEST(CheckRuns, TakesTheShippedPairs) {
  const std::string pairs = GROUSER_PAIRS;
  std::vector<std::string> files = {GROUSER_DENSE_PAIR "/runs.json",
                                    GROUSER_DENSE_PAIR "/coarse.json"};
  for (const auto& pair : std::filesystem::directory_iterator(pairs)) {
    files.push_back((pair.path() / "runs.json").string());
  }
  for (const std::string& file : files) {
    const TrainingSet set = ReadRuns(file);
    EXPECT_NO_THROW(CheckRuns(set)) << file;
  }
  const TrainingSet cmu = ReadRuns(pairs + "/cmu-smooth-62.5-8mm/runs.json");
  EXPECT_GT(ReadMeasured(pairs + "/cmu-smooth-62.5-8mm/measured.csv", LimitsOf(cmu.scene)).size(),
            10u);
}

}  // namespace
}  // namespace grouser::surrogate
