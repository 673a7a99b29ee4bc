// grouser-jobs with fake workers: kills, restarts, and what else goes wrong.
#include <signal.h>

#include "proto/records/run_file.h"
#include "server/jobs/job_store.h"
#include "tests/integration/jobs_harness.h"

namespace grouser::server {
namespace {

using namespace v1alpha1;  // NOLINT: states by name
using testing::Eventually;
using ::testing::HasSubstr;
using testing::IsDead;
using testing::Request;

class JobsCrashTest : public testing::JobsTest {
 protected:
  /// Submits and waits until the DEM worker is at it.
  Job Running() {
    const std::size_t before = DemStarts().size();
    const Job job = Submitted(Request("a"));
    EXPECT_TRUE(Eventually([&] { return DemStarts().size() == before + 1; }));
    return job;
  }
  std::string WorkerRun(const Job& job) const {
    return state_ + "/jobs/" + job.job_id() + "/run.h5";
  }
};

TEST_F(JobsCrashTest, AcknowledgedBeforeKillIsFinishedAfterRestart) {
  Prepare(Request("a"));
  StartJobs();
  const Job job = Running();
  const pid_t worker = DemStarts()[0];
  EXPECT_EQ(StopJobs(SIGKILL).signal, SIGKILL);
  EXPECT_TRUE(Eventually([&] { return IsDead(worker); })) << "it dies with its parent";
  LetDemGo();
  StartJobs();
  const Job done = Await(job.job_id(), JOB_STATE_AWAITING_PROMOTION);
  EXPECT_EQ(done.lease_epoch(), job.lease_epoch() + 1);
  EXPECT_EQ(DemStarts().size(), 2u);
  EXPECT_EQ(Submitted(Request("a")).job_id(), job.job_id()) << "still idempotent";
}

TEST_F(JobsCrashTest, KilledWhileIdleKeepsTheQueue) {
  Prepare(Request("b", 0.2));
  StartJobs();
  Running();
  const Job second = Submitted(Request("b", 0.2));
  EXPECT_EQ(StopJobs(SIGKILL).signal, SIGKILL);
  StartJobs();
  EXPECT_EQ(Get(second.job_id()).job_state(), JOB_STATE_QUEUED);
}

TEST_F(JobsCrashTest, AFinishedRunIsAdoptedAndNotRunAgain) {
  Prepare(Request("a"));
  StartJobs();
  const Job job = Running();
  StopJobs(SIGKILL);
  // The worker had renamed its file before it died, but nobody saw it end.
  std::filesystem::copy(bin_ + "/prepared.run.h5", WorkerRun(job));
  StartJobs();
  const Job done = Await(job.job_id(), JOB_STATE_AWAITING_PROMOTION);
  EXPECT_EQ(done.run_sha256(), records::Sha256OfFile(bin_ + "/prepared.run.h5"));
  EXPECT_EQ(DemStarts().size(), 1u) << "not run again";
}

TEST_F(JobsCrashTest, AHalfWrittenRunIsRunAgain) {
  Prepare(Request("a"));
  StartJobs();
  const Job job = Running();
  StopJobs(SIGKILL);
  testing::WriteText(WorkerRun(job), "half a file");
  LetDemGo();
  StartJobs();
  Await(job.job_id(), JOB_STATE_AWAITING_PROMOTION);
  EXPECT_EQ(DemStarts().size(), 2u);
}

TEST_F(JobsCrashTest, KillDuringTheFitGoesOnThere) {
  Prepare(Request("a"));
  LetDemGo();
  // A fitter that hangs once.
  Fake("grouser-fit", R"sh(
    case $verb in
      refit) if mkdir "$bin/fit.once" 2>/dev/null; then exec sleep 1000; fi
             cp "$bin/prepared.model" "$out" ;;
      gate) cat "$bin/gate.json" ;;
    esac)sh");
  StartJobs();
  const Job job = Submitted(Request("a"));
  ASSERT_TRUE(Eventually([&] { return std::filesystem::exists(bin_ + "/fit.once"); }));
  EXPECT_EQ(Get(job.job_id()).job_state(), JOB_STATE_FITTING);
  EXPECT_TRUE(Get(job.job_id()).has_run());
  StopJobs(SIGKILL);
  StartJobs();
  Await(job.job_id(), JOB_STATE_AWAITING_PROMOTION);
  EXPECT_EQ(DemStarts().size(), 1u);
}

TEST_F(JobsCrashTest, AKilledWorkerIsTriedOnceMore) {
  Prepare(Request("a"));
  StartJobs();
  const Job job = Running();
  ::kill(DemStarts()[0], SIGKILL);
  ASSERT_TRUE(Eventually([&] { return DemStarts().size() == 2; }));
  EXPECT_THAT(Get(job.job_id()).lease_epoch(), 2u);
  LetDemGo();
  Await(job.job_id(), JOB_STATE_AWAITING_PROMOTION);
}

TEST_F(JobsCrashTest, AWorkerKilledTwiceFailsTheJobWithTheReason) {
  StartJobs();
  const Job job = Running();
  ::kill(DemStarts()[0], SIGKILL);
  ASSERT_TRUE(Eventually([&] { return DemStarts().size() == 2; }));
  ::kill(DemStarts()[1], SIGKILL);
  const Job failed = Await(job.job_id(), JOB_STATE_FAILED);
  EXPECT_THAT(failed.message(), HasSubstr("grouser-dem run was killed by signal 9"));
}

TEST_F(JobsCrashTest, BadInputToAWorkerIsNotTriedAgain) {
  Fake("grouser-dem",
       "echo $$ >> \"$bin/dem.started\"; echo 'spec.json: no such grain' >&2; "
       "exit 2\n");
  StartJobs();
  const Job failed = Await(Submitted(Request("a")).job_id(), JOB_STATE_FAILED);
  EXPECT_THAT(failed.message(), HasSubstr("exited with 2: spec.json: no such grain"));
  EXPECT_EQ(DemStarts().size(), 1u);
}

TEST_F(JobsCrashTest, ALyingWorkerIsNotBelieved) {
  Prepare(Request("b", 0.2));  // a run of another state than asked
  LetDemGo();
  StartJobs();
  const Job failed = Await(Submitted(Request("a")).job_id(), JOB_STATE_FAILED);
  EXPECT_THAT(failed.message(), HasSubstr("answers another spec"));
}

TEST_F(JobsCrashTest, MissingProgramsFailTheJobByName) {
  std::filesystem::remove(bin_ + "/grouser-dem");
  StartJobs();
  const Job failed = Await(Submitted(Request("a")).job_id(), JOB_STATE_FAILED);
  EXPECT_THAT(failed.message(), HasSubstr("grouser-dem: No such file"));
}

TEST_F(JobsCrashTest, TermStopsWorkersAndLeavesJobsResumable) {
  Prepare(Request("a"));
  StartJobs();
  const Job job = Running();
  const pid_t worker = DemStarts()[0];
  grpc::ClientContext context;
  WatchJobRequest request;
  request.set_job_id(job.job_id());
  auto watch = stub_->WatchJob(&context, request);
  WatchJobResponse response;
  ASSERT_TRUE(watch->Read(&response));
  EXPECT_TRUE(StopJobs(SIGTERM).Exited(0));
  EXPECT_TRUE(IsDead(worker)) << "before the program ends, not after";
  while (watch->Read(&response)) {
  }
  EXPECT_EQ(watch->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(response.job().job_state(), JOB_STATE_QUEUED);
  LetDemGo();
  StartJobs();
  Await(job.job_id(), JOB_STATE_AWAITING_PROMOTION);
}

TEST_F(JobsCrashTest, APromotionDecidedBeforeAKillIsCarriedOut) {
  Prepare(Request("a"));
  LetDemGo();
  StartJobs();
  const Job job = Await(Submitted(Request("a")).job_id(), JOB_STATE_AWAITING_PROMOTION);
  StopJobs(SIGTERM);
  {
    // As a kill between row and alias leaves it.
    JobStore store(state_ + "/jobs/jobs.sqlite");
    JobRow row = *store.Find(job.job_id());
    row.pending.set_job_id(job.job_id());
    row.pending.set_alias("stable");
    row.pending.set_who("someone");
    ASSERT_TRUE(store.Save(row, row.job.lease_epoch()));
  }
  StartJobs();
  Await(job.job_id(), JOB_STATE_DONE);
  EXPECT_EQ(repository().Resolve("cmu-smooth-62.5").digest, job.candidate_digest());
}

TEST_F(JobsCrashTest, ASecondProgramOnTheSameStateIsRefused) {
  StartJobs();
  WorkerCommand second;
  second.argv = {GROUSER_JOBS_PROGRAM, "--state", state_, "--grpc", "127.0.0.1:0"};
  second.folder = dir_.path();
  second.stdout_path = dir_ / "second.stdout";
  second.log_path = dir_ / "second.log";
  second.limits.memory_bytes = 0;
  EXPECT_TRUE(WorkerProcess::Spawn(std::move(second)).Reap().Exited(1));
  EXPECT_THAT(testing::ReadText(dir_ / "second.log"), HasSubstr("no other grouser-jobs"));
}

TEST_F(JobsCrashTest, APortInUseIsAnErrorThatSaysSo) {
  StartJobs();
  WorkerCommand second;
  second.argv = {GROUSER_JOBS_PROGRAM, "--state", dir_ / "other", "--grpc", address_};
  second.folder = dir_.path();
  second.stdout_path = dir_ / "second.stdout";
  second.log_path = dir_ / "second.log";
  second.limits.memory_bytes = 0;
  EXPECT_TRUE(WorkerProcess::Spawn(std::move(second)).Reap().Exited(1));
  EXPECT_THAT(testing::ReadText(dir_ / "second.log"), HasSubstr("cannot listen"));
}

}  // namespace
}  // namespace grouser::server
