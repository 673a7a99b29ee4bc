#include "dem_offline/campaign/executor.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <memory>

#include "dem_offline/campaign/design.h"
#include "dem_offline/campaign/run_folder.h"
#include "dem_offline/campaign/run_index.h"
#include "dem_offline/scenes/run_identity.h"
#include "dem_offline/scenes/yaml_section.h"
#include "proto/records/durable_file.h"
#include "proto/records/model_file.h"
#include "proto/records/run_file.h"
#include "tests/unit/campaign/fake_backend.h"
#include "tests/unit/records/temp_folder.h"
#include "tests/unit/records/throws.h"

namespace grouser::campaign {
namespace {

using std::chrono::milliseconds;
using ::testing::AllOf;
using ::testing::HasSubstr;

v1alpha1::Campaign SomeCampaign(int runs, int seeds = 1) {
  v1alpha1::Campaign campaign;
  campaign.set_name("c");
  *campaign.mutable_scene() = SomeScene();
  for (int i = 0; i < runs; ++i) {
    auto* run = campaign.add_runs();
    run->set_role(i % 4 == 3 ? v1alpha1::RUN_ROLE_TEST : v1alpha1::RUN_ROLE_TRAIN);
    run->mutable_state()->set_load_n(10 + i);
    run->mutable_state()->set_slip(0.01 * i);
    run->set_seed(static_cast<std::uint64_t>(1 + i % seeds));
    run->set_run_id(RunId(SpecOf(campaign, *run), "fake-1"));
  }
  return campaign;
}

class ExecutorTest : public testing::Test {
 protected:
  v1alpha1::CampaignStatus Run(const v1alpha1::Campaign& campaign, int jobs = 2,
                               milliseconds pause = {}) {
    return RunOn(FakeBackend(&log_, pause), campaign, jobs);
  }
  v1alpha1::CampaignStatus RunOn(const Backend& backend, const v1alpha1::Campaign& campaign,
                                 int jobs) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> out(std::fopen("/dev/null", "w"),
                                                              std::fclose);
    CampaignProgress progress(out.get(), false);
    return RunCampaign(campaign, {.folder = Path(), .jobs = jobs, .known = known_}, backend, stop_,
                       progress);
  }
  std::string Path() const { return folder_ / "c"; }

  /// All files in runs/ are finished, readable and named for what they hold.
  void ExpectOnlyWholeFiles(const v1alpha1::Campaign& campaign) const {
    int planned = 0;
    for (const auto& run : campaign.runs()) {
      const std::string path = RunFolder(Path()).RunPath(run.run_id());
      if (!std::filesystem::exists(path)) continue;
      ++planned;
      EXPECT_EQ(records::ReadRunFile(path).record.run_id(), run.run_id());
    }
    EXPECT_EQ(RunFolder(Path()).RunFiles().size(), static_cast<std::size_t>(planned));
  }
  int Temporaries() const {
    int count = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(Path())) {
      count += entry.path().string().ends_with(records::kTemporarySuffix);
    }
    return count;
  }

  records::TempFolder folder_;
  std::map<std::string, v1alpha1::RunStatus> known_;
  FakeLog log_;
  std::atomic<bool> stop_{false};
};

TEST_F(ExecutorTest, TellsAProgramHowFarItIs) {
  const std::string path = folder_ / "progress";
  {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> out(std::fopen(path.c_str(), "w"),
                                                              std::fclose);
    CampaignProgress progress(out.get(), /*live=*/false, /*lines=*/true);
    RunCampaign(SomeCampaign(4, 2), {.folder = Path(), .jobs = 1}, FakeBackend(&log_, {}), stop_,
                progress);
  }
  const std::string text = records::ReadFileBytes(path);
  EXPECT_THAT(text, HasSubstr("\nprogress 0.2500 eta="));
  EXPECT_THAT(text, HasSubstr("progress 1.0000 eta=0 4 of 4 runs\n"));
}

TEST_F(ExecutorTest, RunsEverythingOnceAndThenNothing) {
  const auto campaign = SomeCampaign(12, 3);
  auto status = Run(campaign, 4);
  EXPECT_EQ(status.done(), 12u);
  EXPECT_EQ(status.steady(), 12u);
  EXPECT_EQ(status.eta_s(), 0.0);
  EXPECT_EQ(log_.runs, 12);
  EXPECT_EQ(log_.tiles, 3);  // one a seed, however many workers
  ExpectOnlyWholeFiles(campaign);
  EXPECT_EQ(RunFolder(Path()).ReadCampaign().SerializeAsString(), campaign.SerializeAsString());
  status = Run(campaign);
  EXPECT_EQ(status.done(), 12u);
  EXPECT_EQ(log_.runs, 12);
  EXPECT_EQ(log_.tiles, 3);
}

TEST_F(ExecutorTest, RunsThatAreKnownFromElsewhereAreCountedAndNotRun) {
  const auto campaign = SomeCampaign(4);
  known_[campaign.runs(1).run_id()] = v1alpha1::RUN_STATUS_OVERLOAD;
  known_["of another campaign"] = v1alpha1::RUN_STATUS_STEADY;
  const auto status = Run(campaign);
  EXPECT_EQ(status.done(), 4u);
  EXPECT_EQ(status.steady(), 3u);
  EXPECT_EQ(status.overload(), 1u);
  EXPECT_EQ(log_.runs, 3);
  EXPECT_FALSE(std::filesystem::exists(RunFolder(Path()).RunPath(campaign.runs(1).run_id())));
}

TEST_F(ExecutorTest, RecordNamesItsTileFile) {
  const auto campaign = SomeCampaign(1);
  Run(campaign);
  const auto record =
      records::ReadRunFile(RunFolder(Path()).RunPath(campaign.runs(0).run_id())).record;
  const std::string tile =
      Path() + "/tiles/" + TileKey(SpecOf(campaign, campaign.runs(0)), "fake-1") + ".tile.h5";
  EXPECT_EQ(record.bed().tile_sha256(), records::Sha256OfFile(tile));
  EXPECT_EQ(record.numerics().engine_version(), "fake-1");
}

TEST_F(ExecutorTest, DamagedRunAndTileFilesAreMadeAgain) {
  const auto campaign = SomeCampaign(4);
  Run(campaign);
  const std::string run = RunFolder(Path()).RunPath(campaign.runs(1).run_id());
  const std::string whole = records::ReadFileBytes(run);
  records::WriteFileDurably(run, whole.substr(0, whole.size() / 2));
  for (const auto& tile : std::filesystem::directory_iterator(Path() + "/tiles")) {
    records::WriteFileDurably(tile.path().string(), "rubbish");
  }
  EXPECT_EQ(Run(campaign).done(), 4u);
  EXPECT_EQ(log_.runs, 5);
  EXPECT_EQ(log_.tiles, 2);
  ExpectOnlyWholeFiles(campaign);
}

TEST_F(ExecutorTest, WhatStandsInAFilesPlaceIsSetAsideAndTheRestGoesOn) {
  const auto campaign = SomeCampaign(4, 2);
  Run(campaign);
  const RunFolder folder(Path());
  std::vector<std::string> in_the_way;  // a FIFO, a folder that holds something, in turn
  const auto replace = [&](const std::string& path) {
    std::filesystem::remove(path);
    if (in_the_way.size() % 2 == 0) {
      ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
    } else {
      std::filesystem::create_directories(path + "/kept");
    }
    in_the_way.push_back(path);
  };
  replace(folder.RunPath(campaign.runs(0).run_id()));
  replace(folder.RunPath(campaign.runs(1).run_id()));
  std::vector<std::string> tiles;
  for (const auto& tile : std::filesystem::directory_iterator(folder.TileFolder())) {
    tiles.push_back(tile.path().string());
  }
  for (const auto& tile : tiles) replace(tile);
  for (int round = 0; round < 2; ++round) {
    replace(folder.IndexPath());
    ASSERT_EQ(mkfifo(folder.RunPath("zz" + std::to_string(round)).c_str(), 0600), 0);
    EXPECT_EQ(Run(campaign).done(), 4u);
    EXPECT_EQ(log_.runs, 6);
    EXPECT_EQ(log_.tiles, 4);
    EXPECT_EQ(RunIndex(folder).All().size(), 4u);
  }
  EXPECT_TRUE(std::filesystem::is_fifo(folder.RunPath("zz0"))) << "not ours: left where it is";
  for (const auto& path : in_the_way) {
    EXPECT_TRUE(std::filesystem::is_regular_file(path)) << path;
    EXPECT_TRUE(std::filesystem::exists(path + ".damaged")) << path;
  }
  EXPECT_TRUE(std::filesystem::exists(folder.IndexPath() + ".damaged-2/kept"));
}

TEST_F(ExecutorTest, AnotherRunsFileUnderThisNameIsNotTaken) {
  const auto campaign = SomeCampaign(2);
  Run(campaign);
  const RunFolder folder(Path());
  std::filesystem::copy_file(folder.RunPath(campaign.runs(0).run_id()),
                             folder.RunPath(campaign.runs(1).run_id()),
                             std::filesystem::copy_options::overwrite_existing);
  Run(campaign);
  EXPECT_EQ(log_.runs, 3);
  ExpectOnlyWholeFiles(campaign);
}

TEST_F(ExecutorTest, FailedRunsAreResultsToo) {
  auto campaign = SomeCampaign(2);
  campaign.mutable_runs(0)->mutable_state()->set_load_n(600);  // the fake fails there
  campaign.mutable_runs(0)->set_run_id(RunId(SpecOf(campaign, campaign.runs(0)), "fake-1"));
  EXPECT_EQ(Run(campaign).failed(), 1u);
  EXPECT_EQ(Run(campaign).failed(), 1u);
  EXPECT_EQ(log_.runs, 2);
}

TEST_F(ExecutorTest, StopLeavesFinishedRunsAndNothingElse) {
  const auto campaign = SomeCampaign(40);
  Backend backend = FakeBackend(&log_);
  const auto run = backend.run;
  backend.run = [&](const dem::WheelTestSpec& spec, const dem::Tile& tile,
                    const dem::ProgressFn& progress) {
    if (log_.runs >= 6) stop_ = true;
    return run(spec, tile, progress);
  };
  const auto status = RunOn(backend, campaign, 2);
  EXPECT_LE(status.done(), 7u);  // the other worker may have been past its last report
  EXPECT_GE(status.done(), 5u);
  ExpectOnlyWholeFiles(campaign);
  EXPECT_EQ(Temporaries(), 0);
  EXPECT_EQ(RunFolder(Path()).RunFiles().size(), status.done());
}

TEST_F(ExecutorTest, StopWhileSettlingStoresNoTile) {
  Backend backend = FakeBackend(&log_);
  const auto prepare = backend.prepare_bed;
  backend.prepare_bed = [&](const dem::BedSpec& spec, const dem::ProgressFn& progress) {
    stop_ = true;
    return prepare(spec, progress);
  };
  EXPECT_EQ(RunOn(backend, SomeCampaign(4), 2).done(), 0u);
  EXPECT_TRUE(std::filesystem::is_empty(Path() + "/tiles"));
  EXPECT_EQ(log_.runs, 0);
}

// kill -9 at many moments: never a broken file, and nothing finished is redone.
// Its soil has Bekker numbers, which are gone: its runs are not repeated for that.
TEST(RunFolder, ReadsACampaignOfAnEarlierVersion) {
  const v1alpha1::Campaign campaign = RunFolder(GROUSER_EARLIER).ReadCampaign();
  ASSERT_EQ(campaign.runs_size(), 1);
  const v1alpha1::WheelTestSpec spec = SpecOf(campaign, campaign.runs(0));
  const std::string id = campaign.runs(0).run_id();
  const auto record = records::ReadRunFile(GROUSER_EARLIER "/" + id + ".run.h5").record;
  EXPECT_EQ(RunId(spec, record.numerics().engine_version()), id);
  EXPECT_EQ(RunId(record.spec(), record.numerics().engine_version()), id);
}

TEST_F(ExecutorTest, KilledAtAnyMomentItResumesAndRepeatsNothing) {
  const auto campaign = SomeCampaign(30, 2);
  std::size_t before = 0;
  for (const int delay_ms : {3, 10, 17, 31, 43}) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      Run(campaign, 2, milliseconds(10));
      _exit(0);
    }
    std::this_thread::sleep_for(milliseconds(delay_ms));
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    if (!std::filesystem::exists(Path() + "/runs")) continue;
    ExpectOnlyWholeFiles(campaign);
    const std::size_t now = RunFolder(Path()).RunFiles().size();
    EXPECT_GE(now, before);
    before = now;
  }
  EXPECT_EQ(Run(campaign).done(), 30u);
  EXPECT_EQ(log_.runs, 30 - static_cast<int>(before));
  ExpectOnlyWholeFiles(campaign);
  EXPECT_EQ(RunIndex(RunFolder(Path())).All().size(), 30u);
}

/// A backend that takes all runs at once, as a card does.
Backend Together(FakeLog* log, int stop_after = 1000) {
  Backend backend = FakeBackend(log);
  const auto one = backend.run;
  backend.run_many = [one, stop_after](const std::vector<dem::gpu::WheelJob>& jobs,
                                       const dem::ProgressFn& progress, const Backend::Done& done) {
    int n = 0;
    for (std::size_t k = 0; k < jobs.size(); ++k) {
      dem::WheelTestResult result =
          one(jobs[k].spec, *jobs[k].tile, [](double, const std::string&) { return true; });
      if (++n > stop_after || !progress(static_cast<double>(k) / jobs.size(), "device")) {
        result.status = dem::RunStatus::kFailed;
        result.stopped = dem::StopCause::kCaller;
      }
      done(k, result);
    }
  };
  return backend;
}

TEST_F(ExecutorTest, ADeviceTakesAllRunsTogetherAndResumes) {
  const auto campaign = SomeCampaign(9, 3);
  auto status = RunOn(Together(&log_, 5), campaign, 2);
  EXPECT_EQ(status.done(), 5u);  // those cut short are no results
  ExpectOnlyWholeFiles(campaign);
  EXPECT_EQ(log_.tiles, 3);
  log_.runs = 0;
  status = RunOn(Together(&log_), campaign, 2);
  EXPECT_EQ(status.done(), 9u);
  EXPECT_EQ(log_.runs, 4);
  ExpectOnlyWholeFiles(campaign);
}

TEST_F(ExecutorTest, LeftOversOfAKilledWriterAreRemoved) {
  const auto campaign = SomeCampaign(1);
  Run(campaign);
  records::WriteFileDurably(Path() + "/runs/x.run.h5.12-12-0.tmp", "half");
  Run(campaign);
  EXPECT_EQ(Temporaries(), 0);
}

TEST_F(ExecutorTest, FullDiskEndsTheCampaignAndLosesNothing) {
  const auto campaign = SomeCampaign(8);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto previous = std::signal(SIGXFSZ, SIG_IGN);
  rlimit tight = before;
  tight.rlim_cur = 15000;  // less than a run file, more than campaign.json and index
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &tight), 0);
  const std::string message = MessageOf([&] { Run(campaign); });
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, previous);
  EXPECT_THAT(message, AllOf(HasSubstr(".h5"), HasSubstr("cannot write")));
  ExpectOnlyWholeFiles(campaign);
  EXPECT_EQ(Temporaries(), 0);
  EXPECT_EQ(Run(campaign).done(), 8u);
}

TEST_F(ExecutorTest, EngineErrorsEndTheCampaignWithTheirWords) {
  const Backend good = FakeBackend(&log_);
  Backend bad = good;
  bad.prepare_bed = [](const dem::BedSpec&, const dem::ProgressFn&) -> dem::Tile {
    throw std::runtime_error("no solid fraction within reach");
  };
  EXPECT_THAT(MessageOf([&] { RunOn(bad, SomeCampaign(4), 3); }),
              HasSubstr("no solid fraction within reach"));
}

TEST_F(ExecutorTest, BadSpecsAreRefusedBeforeAnythingRuns) {
  auto campaign = SomeCampaign(3);
  campaign.mutable_runs(2)->mutable_state()->set_load_n(2000);
  EXPECT_THROW(Run(campaign), InputError);
  EXPECT_EQ(log_.runs, 0);
  EXPECT_FALSE(std::filesystem::exists(Path()));
}

TEST_F(ExecutorTest, AFolderInUseAndAnotherCampaignsFolderAreRefused) {
  auto campaign = SomeCampaign(1);
  Run(campaign);
  {
    const os::UniqueFd lock = RunFolder(Path()).Lock();
    EXPECT_THAT(MessageOf([&] { Run(campaign); }),
                HasSubstr("in use by another campaign run (process " + std::to_string(getpid())));
  }
  campaign.set_name("d");
  EXPECT_THAT(MessageOf([&] { Run(campaign); }), HasSubstr("holds campaign 'c', not 'd'"));
}

TEST_F(ExecutorTest, ATileBeingSettledKeepsNobodyFromOtherWork) {
  // Neither tile gets ready before both have been asked for: an executor whose
  // second worker waited for the first tile would hang here (and give up).
  Backend backend = FakeBackend(&log_);
  const auto prepare = backend.prepare_bed;
  std::atomic<bool> together{true};
  backend.prepare_bed = [&](const dem::BedSpec& spec, const dem::ProgressFn& progress) {
    auto tile = prepare(spec, progress);
    for (int i = 0; log_.tiles < 2 && i < 30000; ++i) std::this_thread::sleep_for(milliseconds(1));
    if (log_.tiles < 2) together = false;
    return tile;
  };
  RunOn(backend, SomeCampaign(6, 2), 2);
  EXPECT_TRUE(together);
}

TEST_F(ExecutorTest, IndexFollowsTheFilesAndIsRebuiltFromThem) {
  const auto campaign = SomeCampaign(5);
  Run(campaign);
  const RunFolder folder(Path());
  const auto before = RunIndex(folder).All();
  ASSERT_EQ(before.size(), 5u);
  const std::string id = campaign.runs(2).run_id();
  EXPECT_EQ(before.at(id).summary.sha256(), records::Sha256OfFile(folder.RunPath(id)));
  EXPECT_DOUBLE_EQ(before.at(id).summary.mean(0), 0.02 * 12);
  EXPECT_EQ(before.at(id).summary.load_n(), 12);

  records::WriteFileDurably(folder.IndexPath(), std::string(9000, 'x'));  // no database
  RunIndex index(folder);
  EXPECT_TRUE(index.All().empty());
  EXPECT_TRUE(index.Refresh().empty());
  EXPECT_EQ(index.All().at(id).summary.SerializeAsString(),
            before.at(id).summary.SerializeAsString());

  std::filesystem::remove(folder.RunPath(id));
  records::WriteFileDurably(folder.RunPath("zz"), "cut");
  EXPECT_THAT(index.Refresh().at("zz.run.h5"), HasSubstr("not an HDF5 file"));
  EXPECT_EQ(index.All().size(), 4u);
  EXPECT_EQ(RunIndex::Rebuild(folder).size(), 1u);
  EXPECT_EQ(RunIndex(folder).All().size(), 4u);
}

TEST(RunFolderTest, ForeignFoldersAreInputErrors) {
  const records::TempFolder folder;
  EXPECT_THROW(RunFolder(folder / "none").ReadCampaign(), InputError);
  EXPECT_THROW(RunFolder(folder / "none").RunFiles(), InputError);
  records::WriteFileDurably(folder / "campaign.json", "{]");
  EXPECT_THAT(MessageOf([&] { RunFolder(folder / ".").ReadCampaign(); }),
              HasSubstr("not a grouser.v1alpha1.Campaign"));
}

TEST(Progress, TimesForPeople) {
  EXPECT_EQ(ForPeople(12.4), "12 s");
  EXPECT_EQ(ForPeople(200), "3 min 20 s");
  EXPECT_EQ(ForPeople(3720), "1 h 02 min");
  EXPECT_EQ(ForPeople(std::nan("")), "unknown");
}

}  // namespace
}  // namespace grouser::campaign
