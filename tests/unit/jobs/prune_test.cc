// What pruning keeps and removes, also when it is killed in between.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <set>

#include "proto/records/model_file.h"
#include "server/jobs/pruner.h"
#include "server/jobs/refinement_spec.h"
#include "server/jobs/request_checks.h"
#include "tests/unit/jobs/jobs_fixtures.h"
#include "tests/unit/records/throws.h"

namespace grouser::server {
namespace {

using namespace v1alpha1;  // NOLINT: states by name
using testing::BaseModel;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Not;
using testing::Request;
using ::testing::UnorderedElementsAre;

constexpr char kName[] = "cmu-smooth-62.5";
constexpr double kFuture = 1e6;  ///< [s] after now: everything has settled

/// A state folder with models, runs and jobs as the jobs program leaves them.
class PruneTest : public ::testing::Test {
 protected:
  PruneTest()
      : repository_(dir_.path(), ""),
        files_(dir_.path()),
        store_(files_.Database()),
        book_(
            store_, 64, [this] { return now_; }, [](const Job&) {}) {
    first_ = Publish("first", "", "");
    repository_.SetAlias(kName, "stable", first_, "test", "");
  }

  std::string Publish(const std::string& reason, const std::string& base, const std::string& run) {
    Model model = BaseModel();
    model.mutable_provenance()->set_reason(reason);
    model.mutable_provenance()->set_base_digest(base);
    if (!run.empty()) model.mutable_provenance()->add_runs()->set_file(run);
    const std::string path = dir_ / "new.model";
    records::WriteModelFile(path, model);
    const std::string digest = repository_.Publish(path);
    std::filesystem::remove(path);
    return digest;
  }

  /// A job that has run and offers a candidate; a second each. Returns its row.
  Job Refined(const std::string& request_id, double slip) {
    now_ += 1;
    const auto request = Request(request_id, slip);
    const auto spec = BuildSpec(BaseModel(), request);
    const std::string base = repository_.Resolve(kName).digest;
    const auto submitted =
        book_.Submit(request_id, ContentOf(request), RowOf(request, kName, base, spec), "someone");
    const std::string& id = submitted.job().job_id();
    const std::string run = "run" + request_id + ".run.h5";
    testing::WriteText(files_.Run(run), std::string(10'000, 'r'));
    std::filesystem::create_directories(files_.Folder(id));
    testing::WriteText(files_.Folder(id) + "/dem.1.log", std::string(1000, 'l'));
    for (const auto state : {JOB_STATE_RUNNING, JOB_STATE_FITTING, JOB_STATE_VALIDATING}) {
      book_.Change(id, 1, [&](JobRow& row) { row.job.set_job_state(state); });
    }
    const std::string digest = Publish(id, base, run);
    return book_
        .Change(id, 1,
                [&](JobRow& row) {
                  row.job.set_run_file(run);
                  row.job.set_candidate_digest(digest);
                  row.job.set_job_state(JOB_STATE_AWAITING_PROMOTION);
                })
        ->job;
  }
  void End(const Job& job, JobState state) {
    book_.Change(job.job_id(), 1, [&](JobRow& row) { row.job.set_job_state(state); });
  }
  Job Promoted(const std::string& request_id, double slip) {
    const Job job = Refined(request_id, slip);
    repository_.SetAlias(kName, "stable", job.candidate_digest(), "test", request_id);
    End(job, JOB_STATE_DONE);
    return job;
  }
  Job Dropped(const std::string& request_id, double slip) {
    const Job job = Refined(request_id, slip);
    End(job, JOB_STATE_CANCELLED);
    return job;
  }

  PruneResponse Prune(PruneLimits limits, bool dry_run = false,
                      Pruner::Remover remove = Pruner::RemoveAll) {
    Pruner pruner(files_, store_, book_, repository_, std::move(remove));
    return pruner.Prune(limits, dry_run, UnixNow() + kFuture);
  }
  static double UnixNow() { return static_cast<double>(::time(nullptr)); }
  static std::set<std::string> NamesOf(const PruneResponse& response) {
    std::set<std::string> names;
    for (const auto& item : response.items()) names.insert(item.name());
    return names;
  }
  std::set<std::string> FilesIn(const std::string& folder) const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(files_.Below(folder))) {
      names.insert(entry.path().filename().string());
    }
    return names;
  }
  std::size_t CountJobs() { return store_.List(1000)->size(); }
  /// What is named is there.
  void ExpectWhole() {
    const Repository repository(dir_.path(), "");
    const auto aliases = repository.ReadAliases();
    for (const auto& [alias, digest] : aliases.by_model.at(kName)) {
      EXPECT_EQ(repository.Resolve(std::string(kName) + "@" + alias).digest, digest);
    }
    const auto jobs = store_.List(1000);
    for (const Job& job : *jobs) {
      if (job.run_file().empty()) continue;
      EXPECT_TRUE(std::filesystem::exists(files_.Run(job.run_file()))) << job.job_id();
    }
  }

  static constexpr PruneLimits kAll{1, 0, 0};  ///< all that may go

  testing::TempDir dir_;
  double now_ = UnixNow() - 1000;
  Repository repository_;
  JobFiles files_;
  JobStore store_;
  JobBook book_;
  std::string first_;
};

TEST_F(PruneTest, KeepsWhatAliasesJobsAndModelsName) {
  const Job promoted = Promoted("a", 0.1);
  const Job dropped = Dropped("b", 0.2);
  const Job waiting = Refined("c", 0.3);
  testing::WriteText(files_.Tiles() + "/old.tile", "t");
  const auto response = Prune(kAll);
  EXPECT_THAT(
      NamesOf(response),
      UnorderedElementsAre(promoted.job_id(), dropped.job_id(), "runs/runb.run.h5",
                           "models/" + dropped.candidate_digest() + ".model", "tiles/old.tile"));
  EXPECT_THAT(FilesIn("runs"), UnorderedElementsAre("runa.run.h5", "runc.run.h5"))
      << "of the stable model, and of the open job";
  EXPECT_THAT(FilesIn("models"),
              IsSupersetOf({first_ + ".model", promoted.candidate_digest() + ".model",
                            waiting.candidate_digest() + ".model", std::string("aliases.json")}));
  EXPECT_EQ(CountJobs(), 1u);
  EXPECT_EQ(repository_.Rollback(kName, "stable", "", "op", "").digest, first_);
  ExpectWhole();
  EXPECT_THAT(NamesOf(Prune(kAll)), IsEmpty()) << "nothing is left to go";
}

TEST_F(PruneTest, RollbackHistoryIsKeptSoFarBack) {
  std::vector<Job> jobs;
  for (std::size_t i = 0; i < kRollbacksKept + 3; ++i) {
    jobs.push_back(Promoted(std::to_string(i), 0.01 * static_cast<double>(i)));
  }
  const auto gone = NamesOf(Prune(kAll));
  // The last of the kept moves led from jobs[2]'s, which was refitted from jobs[1]'s.
  EXPECT_THAT(gone, Contains("models/" + jobs[0].candidate_digest() + ".model"));
  EXPECT_THAT(gone, Not(Contains("models/" + jobs[1].candidate_digest() + ".model")));
  EXPECT_THAT(gone, Not(Contains("models/" + jobs[2].candidate_digest() + ".model")));
  EXPECT_THAT(gone, Contains("runs/run0.run.h5"));
  for (std::size_t i = 0; i < kRollbacksKept; ++i) {
    repository_.Rollback(kName, "stable", "", "op", "");
  }
  EXPECT_EQ(repository_.Resolve(kName).digest, jobs[2].candidate_digest());
}

TEST_F(PruneTest, WhatRollbacksLeadToIsKeptAfterRollbacksToo) {
  std::vector<Job> jobs;
  for (std::size_t i = 0; i < 2 * kRollbacksKept + 4; ++i) {
    jobs.push_back(Promoted(std::to_string(i), 0.01 * static_cast<double>(i)));
  }
  const auto back = [&] { return repository_.Rollback(kName, "stable", "", "op", "").digest; };
  for (std::size_t i = 0; i < kRollbacksKept; ++i) back();
  Prune(kAll);
  for (std::size_t i = 1; i <= kRollbacksKept; ++i) {
    EXPECT_EQ(back(), jobs[kRollbacksKept + 3 - i].candidate_digest());
  }
}

TEST_F(PruneTest, WhatCannotBeRemovedIsReportedAndTheRestGoes) {
  const Job dropped = Dropped("a", 0.1), other = Dropped("b", 0.2);
  const std::string stuck = files_.Run(dropped.run_file());
  const auto remove = [&](const std::string& path) {
    if (path == stuck) throw std::runtime_error(path + ": cannot be removed: busy");
    Pruner::RemoveAll(path);
  };
  const auto response = Prune(kAll, /*dry_run=*/false, remove);
  ASSERT_EQ(response.failed_count(), 1u);
  EXPECT_EQ(response.failed(0).name(), "runs/" + dropped.run_file());
  EXPECT_THAT(response.failed(0).why(), HasSubstr("busy"));
  EXPECT_EQ(response.items_count(), 5u) << "two jobs, two models, the other run";
  EXPECT_THAT(FilesIn("runs"), UnorderedElementsAre(dropped.run_file()));
  EXPECT_EQ(Prune(kAll).items_count(), 1u) << "once it can be";
}

TEST_F(PruneTest, WhatOthersPutAmongTheRunsAndModelsStays) {
  for (const char* folder : {"runs/mine", "runs/mine.run.h5", "models/old.model"}) {
    std::filesystem::create_directories(files_.Below(folder));
    testing::WriteText(files_.Below(std::string(folder) + "/notes.txt"), "mine");
  }
  testing::WriteText(files_.Below("runs/README"), "mine");
  EXPECT_EQ(Prune(kAll).items_count(), 0u);
  EXPECT_THAT(FilesIn("runs"), UnorderedElementsAre("mine", "mine.run.h5", "README"));
}

TEST_F(PruneTest, AnAliasOfItsOwnKeepsAModelAndItsRuns) {
  const Job dropped = Dropped("a", 0.1);
  repository_.SetAlias(kName, "paper-2026", dropped.candidate_digest(), "test", "");
  const auto gone = NamesOf(Prune(kAll));
  EXPECT_THAT(gone, UnorderedElementsAre(dropped.job_id()));
  EXPECT_THAT(FilesIn("runs"), Contains("runa.run.h5"));
}

TEST_F(PruneTest, OldestGoFirstUntilTheLimitHolds) {
  std::vector<Job> jobs;
  for (int i = 0; i < 4; ++i) jobs.push_back(Dropped(std::to_string(i), 0.1 * i));
  for (const auto& job : jobs) {  // files as old as their jobs
    const auto at = std::filesystem::file_time_type::clock::now() - std::chrono::hours(1);
    std::filesystem::last_write_time(files_.Run(job.run_file()), at);
    std::filesystem::last_write_time(files_.Below("models/" + job.candidate_digest() + ".model"),
                                     at);
  }
  PruneLimits limits;
  limits.settle_s = 0;
  limits.max_bytes = Prune(limits, true).bytes_before() - 12'000;
  const auto planned = Prune(limits, /*dry_run=*/true);
  EXPECT_EQ(CountJobs(), 4u) << "a dry run removes nothing";
  EXPECT_THAT(planned.items(0).why(), HasSubstr("MB are used, allowed are"));
  const auto done = Prune(limits);
  EXPECT_EQ(NamesOf(done), NamesOf(planned));
  EXPECT_EQ(done.items(0).name(), jobs[0].job_id());
  EXPECT_GE(done.bytes_freed(), 12'000u);
  EXPECT_THAT(NamesOf(done), Not(Contains(jobs[3].job_id())));
  EXPECT_LE(done.bytes_before() - done.bytes_freed(), limits.max_bytes);
  ExpectWhole();
}

TEST_F(PruneTest, AgeAndSettlingAreKept) {
  Dropped("a", 0.1);
  PruneLimits limits{0, 2 * kFuture, 0};
  EXPECT_THAT(NamesOf(Prune(limits)), IsEmpty()) << "young enough";
  limits.keep_s = kFuture / 2;
  limits.settle_s = 2 * kFuture;
  EXPECT_THAT(NamesOf(Prune(limits)), IsEmpty()) << "not settled";
  limits.settle_s = 0;
  const auto gone = Prune(limits);
  EXPECT_EQ(gone.items_count(), 3u);
  EXPECT_THAT(gone.items(0).why(), HasSubstr("days old"));
}

TEST_F(PruneTest, PrunesNothingWhereItCannotSeeWhatIsNamed) {
  Dropped("a", 0.1);
  const std::string stable = files_.Below("models/" + first_ + ".model");
  const std::string bytes = testing::ReadText(stable);
  testing::WriteText(stable, "damaged");
  EXPECT_THAT(MessageOf([&] { Prune(kAll); }), HasSubstr(stable));
  testing::WriteText(stable, bytes);
  const std::string aliases = testing::ReadText(files_.Below("models/aliases.json"));
  testing::WriteText(files_.Below("models/aliases.json"), "{");
  EXPECT_THAT(MessageOf([&] { Prune(kAll); }), HasSubstr("aliases.json"));
  testing::WriteText(files_.Below("models/aliases.json"), aliases);
  EXPECT_EQ(CountJobs(), 1u);
  EXPECT_EQ(Prune(kAll).items_count(), 3u);
}

TEST_F(PruneTest, AJobOfARemovedRowIsForgottenWithItsRequest) {
  const Job dropped = Dropped("a", 0.1);
  Prune(kAll);
  EXPECT_FALSE(store_.FindRequest("a").has_value());
  EXPECT_FALSE(std::filesystem::exists(files_.Folder(dropped.job_id())));
  const Job open = Refined("b", 0.2);
  store_.Remove(open.job_id());
  EXPECT_TRUE(store_.Find(open.job_id()).has_value()) << "an open job is never removed";
  EXPECT_TRUE(store_.FindRequest("b").has_value());
}

// Killed before or after any removal; the next pruning ends where an undisturbed one does.
TEST_F(PruneTest, KilledAtAnyRemovalItLeavesAWholeStore) {
  Promoted("a", 0.1);
  Refined("w", 0.15);
  int expected = 0;
  for (int at = 0;; ++at) {
    SCOPED_TRACE(at);
    Dropped("x" + std::to_string(at), 0.2);
    Dropped("y" + std::to_string(at), 0.3);
    if (at == 0) expected = static_cast<int>(Prune(kAll, true).items_count());
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      int removed = 0;
      const JobFiles files(dir_.path());
      JobStore store(files.Database());
      const JobBook book(
          store, 64, [] { return 0.0; }, [](const Job&) {});
      Pruner pruner(files, store, book, repository_, [&](const std::string& path) {
        if (removed == at / 2 && at % 2 == 0) ::kill(::getpid(), SIGKILL);
        Pruner::RemoveAll(path);
        if (removed++ == at / 2) ::kill(::getpid(), SIGKILL);
      });
      pruner.Prune(kAll, false, UnixNow() + kFuture);
      ::_exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    ExpectWhole();
    Prune(kAll);
    EXPECT_THAT(FilesIn("runs"), UnorderedElementsAre("runa.run.h5", "runw.run.h5"));
    EXPECT_EQ(CountJobs(), 1u);
    EXPECT_EQ(FilesIn("jobs").count("job-"), 0u);
    if (WIFEXITED(status)) {
      ASSERT_EQ(WEXITSTATUS(status), 0);
      EXPECT_GE(at, 2 * (expected - 1)) << "killed at every removal";
      return;
    }
  }
}

}  // namespace
}  // namespace grouser::server
