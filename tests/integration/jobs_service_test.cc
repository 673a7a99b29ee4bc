// grouser-jobs over gRPC with fake workers: the way of a job, and bad input.
#include <grpcpp/generic/generic_stub.h>
#include <signal.h>
#include <sys/resource.h>

#include <cmath>
#include <limits>

#include "proto/records/model_file.h"
#include "server/jobs/job_state.h"
#include "tests/integration/jobs_harness.h"

namespace grouser::server {
namespace {

using namespace v1alpha1;  // NOLINT: states by name
using ::testing::ElementsAre;
using testing::Eventually;
using ::testing::HasSubstr;
using testing::ReadText;
using testing::Request;

class JobsServiceTest : public testing::JobsTest {
 protected:
  PromoteRequest PromotionOf(const std::string& job_id) {
    PromoteRequest request;
    request.set_job_id(job_id);
    request.set_who("a tester");
    request.set_why("it is better");
    return request;
  }
};

/// States in order of a watch, repeats dropped; ends when the stream ends or
/// at `until`.
std::vector<std::string> Follow(JobsService::Stub& stub, const std::string& job_id, JobState until,
                                grpc::Status* status) {
  grpc::ClientContext context;
  WatchJobRequest request;
  request.set_job_id(job_id);
  auto reader = stub.WatchJob(&context, request);
  std::vector<std::string> states;
  WatchJobResponse response;
  std::uint64_t revision = 0;
  while (reader->Read(&response)) {
    EXPECT_GE(response.job().revision(), revision);
    revision = response.job().revision();
    const std::string state = ShortName(response.job().job_state());
    if (states.empty() || states.back() != state) states.push_back(state);
    if (response.job().job_state() == until) context.TryCancel();
  }
  *status = reader->Finish();
  return states;
}

TEST_F(JobsServiceTest, WorkersKeepTheFormerDescriptorLimit) {
  struct rlimit own {};
  ::getrlimit(RLIMIT_NOFILE, &own);
  const struct rlimit low { 200, own.rlim_max };
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &low), 0);
  Fake("grouser-dem", "ulimit -Sn > \"$bin/limit.part\"; mv \"$bin/limit.part\" \"$bin/limit\"");
  Prepare(Request("a"));
  StartJobs();
  Submitted(Request("a"));
  EXPECT_TRUE(Eventually([&] { return std::filesystem::exists(bin_ + "/limit"); }));
  EXPECT_EQ(ReadText(bin_ + "/limit"), "200\n");
  ::setrlimit(RLIMIT_NOFILE, &own);
}

TEST_F(JobsServiceTest, SubmitWatchCandidatePromote) {
  Prepare(Request("a"));
  StartJobs();
  const Job job = Submitted(Request("a"));
  EXPECT_EQ(job.model(), "cmu-smooth-62.5@sha256:" + base_digest_);
  Await(job.job_id(), JOB_STATE_RUNNING);
  ASSERT_TRUE(Eventually([&] { return Get(job.job_id()).message() == "settling"; }));
  EXPECT_EQ(Get(job.job_id()).progress(), 0.25);

  std::vector<std::string> states;
  grpc::Status watch;
  std::thread watcher([&] { states = Follow(*stub_, job.job_id(), JOB_STATE_DONE, &watch); });
  LetDemGo();
  const Job fitted = Await(job.job_id(), JOB_STATE_AWAITING_PROMOTION);
  EXPECT_EQ(fitted.run().outputs(0).mean(), 1.5) << "the asker gets the DEM result itself";
  EXPECT_EQ(fitted.run_sha256().size(), 64u);
  EXPECT_TRUE(std::filesystem::exists(state_ + "/runs/" + fitted.run_file()));
  ASSERT_EQ(fitted.gate_size(), 1);
  EXPECT_TRUE(fitted.gate(0).passed());
  EXPECT_EQ(repository().Resolve("cmu-smooth-62.5").digest, base_digest_) << "not by itself";
  EXPECT_TRUE(Eventually([&] {
    const auto aliases = repository().ReadAliases();
    return aliases.by_model.at("cmu-smooth-62.5").contains("candidate");
  }));
  EXPECT_EQ(repository().Resolve("cmu-smooth-62.5@candidate").digest, fitted.candidate_digest());

  PromoteResponse promoted;
  const auto status = Promote(PromotionOf(job.job_id()), &promoted);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(promoted.job().job_state(), JOB_STATE_DONE);
  EXPECT_EQ(promoted.job().who(), "local");
  watcher.join();
  EXPECT_TRUE(watch.ok() || watch.error_code() == grpc::StatusCode::CANCELLED);
  ASSERT_FALSE(states.empty());
  EXPECT_EQ(states.back(), "DONE");
  const auto repo = repository();
  EXPECT_EQ(repo.Resolve("cmu-smooth-62.5").digest, fitted.candidate_digest());
  EXPECT_EQ(repo.Resolve("cmu-smooth-62.5@previous").digest, base_digest_);
  EXPECT_EQ(repo.ReadAliases().history.back().who, "local (says: a tester)")
      << "who comes from the connection, not from the request";
  EXPECT_EQ(repo.ReadAliases().generation, promoted.generation());

  PromoteResponse again;
  EXPECT_TRUE(Promote(PromotionOf(job.job_id()), &again).ok()) << "asked again: same answer";
  EXPECT_EQ(again.generation(), promoted.generation());
  EXPECT_EQ(repo.Resolve("cmu-smooth-62.5@previous").digest, base_digest_);
}

TEST_F(JobsServiceTest, ManyWatchersSeeEveryStateAndTheEnd) {
  Prepare(Request("a"), RUN_STATUS_OVERLOAD);
  StartJobs();
  const Job job = Submitted(Request("a"));
  Await(job.job_id(), JOB_STATE_RUNNING);
  constexpr int kWatchers = 20;
  std::vector<std::vector<std::string>> states(kWatchers);
  std::vector<grpc::Status> ends(kWatchers);
  std::vector<std::thread> threads;
  for (int i = 0; i < kWatchers; ++i) {
    // Some leave early, as clients do.
    const JobState until = i % 4 == 3 ? JOB_STATE_RUNNING : JOB_STATE_UNSPECIFIED;
    threads.emplace_back(
        [&, i, until] { states[i] = Follow(*stub_, job.job_id(), until, &ends[i]); });
  }
  LetDemGo();
  for (auto& thread : threads) thread.join();
  for (int i = 0; i < kWatchers; ++i) {
    if (i % 4 == 3) continue;
    EXPECT_TRUE(ends[i].ok()) << ends[i].error_message();
    EXPECT_EQ(states[i].back(), "FAILED");
  }
  grpc::Status end;
  EXPECT_THAT(Follow(*stub_, job.job_id(), JOB_STATE_UNSPECIFIED, &end), ElementsAre("FAILED"));
  EXPECT_TRUE(end.ok()) << "an ended job is told at once";
}

TEST_F(JobsServiceTest, AnUnsteadyRunEndsTheJobButIsKept) {
  Prepare(Request("a"), RUN_STATUS_UNSTEADY);
  LetDemGo();
  StartJobs();
  const Job job = Await(Submitted(Request("a")).job_id(), JOB_STATE_FAILED);
  EXPECT_THAT(job.message(), HasSubstr("UNSTEADY (it drifts)"));
  EXPECT_EQ(job.run().status(), RUN_STATUS_UNSTEADY);
  EXPECT_TRUE(std::filesystem::exists(state_ + "/runs/" + job.run_file()));
  PromoteResponse response;
  const auto status = Promote(PromotionOf(job.job_id()), &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
}

TEST_F(JobsServiceTest, AFailedGateNeedsAnOverride) {
  Prepare(Request("a"));
  LetDemGo();
  testing::WriteText(bin_ + "/gate.json", R"([{"name":"held_out","passed":false,"detail":"x"}])");
  testing::WriteText(bin_ + "/gate.exit", "3");
  StartJobs();
  const Job job = Await(Submitted(Request("a")).job_id(), JOB_STATE_AWAITING_PROMOTION);
  EXPECT_THAT(job.message(), HasSubstr("held_out"));
  auto request = PromotionOf(job.job_id());
  PromoteResponse response;
  EXPECT_EQ(Promote(request, &response).error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(repository().Resolve("cmu-smooth-62.5").digest, base_digest_);
  request.set_override_gate(true);
  EXPECT_TRUE(Promote(request, &response).ok());
  EXPECT_EQ(repository().Resolve("cmu-smooth-62.5").digest, job.candidate_digest());
}

TEST_F(JobsServiceTest, APromotionMustNotUndoAnother) {
  Prepare(Request("a"));
  LetDemGo();
  StartJobs();
  const Job job = Await(Submitted(Request("a")).job_id(), JOB_STATE_AWAITING_PROMOTION);
  // Meanwhile another model became stable, which this candidate knows nothing of.
  Model other = testing::BaseModel();
  other.mutable_provenance()->set_reason("another refinement");
  const std::string file = dir_ / "other.model";
  const std::string digest = records::WriteModelFile(file, other);
  auto repo = repository();
  repo.Publish(file);
  repo.SetAlias("cmu-smooth-62.5", "stable", digest, "someone else", "test");
  auto request = PromotionOf(job.job_id());
  PromoteResponse response;
  const auto status = Promote(request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(), HasSubstr("has moved"));
  EXPECT_EQ(repo.Resolve("cmu-smooth-62.5").digest, digest);
  request.set_override_gate(true);
  EXPECT_TRUE(Promote(request, &response).ok());
}

TEST_F(JobsServiceTest, CanaryThenStableThenBack) {
  Prepare(Request("a"));
  LetDemGo();
  StartJobs();
  const Job job = Await(Submitted(Request("a")).job_id(), JOB_STATE_AWAITING_PROMOTION);
  const std::string name = "cmu-smooth-62.5";
  const auto move = [&](const std::string& model, const std::string& alias,
                        MoveAliasResponse* response) {
    grpc::ClientContext context;
    MoveAliasRequest request;
    request.set_model(model);
    request.set_alias(alias);
    request.set_who("op");
    request.set_why("test");
    return stub_->MoveAlias(&context, request, response);
  };
  MoveAliasResponse moved;
  const auto early = move(name + "@sha256:" + job.candidate_digest(), "stable", &moved);
  EXPECT_EQ(early.error_code(), grpc::StatusCode::FAILED_PRECONDITION) << "no gate was asked";
  EXPECT_THAT(early.error_message(), HasSubstr("a candidate that no promotion has let through"));
  EXPECT_EQ(move("nothing@canary", "stable", &moved).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(move(name, "previous", &moved).error_code(), grpc::StatusCode::INVALID_ARGUMENT);

  auto request = PromotionOf(job.job_id());
  request.set_alias("canary");
  PromoteResponse promoted;
  ASSERT_TRUE(Promote(request, &promoted).ok());
  EXPECT_EQ(repository().Resolve(name).digest, base_digest_) << "a canary is not stable";
  EXPECT_EQ(repository().Resolve(name + "@canary").digest, job.candidate_digest());
  ASSERT_TRUE(move(name + "@canary", "", &moved).ok());
  EXPECT_EQ(moved.move().from_digest(), base_digest_);
  EXPECT_EQ(moved.move().to_digest(), job.candidate_digest());
  EXPECT_EQ(repository().Resolve(name).digest, job.candidate_digest());

  grpc::ClientContext back_context, again_context, list_context;
  RollbackAliasRequest back;
  back.set_model(name);
  back.set_who("op");
  back.set_why("worse");
  ASSERT_TRUE(stub_->RollbackAlias(&back_context, back, &moved).ok());
  EXPECT_EQ(moved.move().to_digest(), base_digest_);
  EXPECT_TRUE(moved.move().rollback());
  EXPECT_EQ(repository().Resolve(name).digest, base_digest_);
  EXPECT_EQ(stub_->RollbackAlias(&again_context, back, &moved).error_code(),
            grpc::StatusCode::NOT_FOUND);

  ListAliasMovesRequest list;
  list.set_model(name + "@stable");
  list.set_page_size(1);
  ListAliasMovesResponse page;
  ASSERT_TRUE(stub_->ListAliasMoves(&list_context, list, &page).ok());
  ASSERT_EQ(page.moves_size(), 1);
  EXPECT_EQ(page.moves(0).why(), "worse");
  list.set_page_token(page.next_page_token());
  list.set_page_size(10);
  grpc::ClientContext next_context;
  ASSERT_TRUE(stub_->ListAliasMoves(&next_context, list, &page).ok());
  ASSERT_EQ(page.moves_size(), 1);
  EXPECT_EQ(page.moves(0).to_digest(), job.candidate_digest());
  EXPECT_EQ(page.next_page_token(), "");
}

TEST_F(JobsServiceTest, AGateMayPromoteByItself) {
  Prepare(Request("a"));
  LetDemGo();
  StartJobs({"--auto-promote", "stable"});
  const Job job = Await(Submitted(Request("a")).job_id(), JOB_STATE_DONE);
  EXPECT_EQ(repository().Resolve("cmu-smooth-62.5").digest, job.candidate_digest());
  const auto aliases = repository().ReadAliases();
  EXPECT_EQ(aliases.history.back().who, "grouser-jobs");
  EXPECT_THAT(aliases.history.back().why, HasSubstr("passes the gate"));
}

TEST_F(JobsServiceTest, AGateThatFailsPromotesNothing) {
  Prepare(Request("a"));
  LetDemGo();
  testing::WriteText(bin_ + "/gate.json", R"([{"name":"held_out","passed":false,"detail":"x"}])");
  testing::WriteText(bin_ + "/gate.exit", "3");
  StartJobs({"--auto-promote", "stable"});
  Await(Submitted(Request("a")).job_id(), JOB_STATE_AWAITING_PROMOTION);
  EXPECT_TRUE(Eventually([&] {
    return repository().ReadAliases().by_model.at("cmu-smooth-62.5").contains("candidate");
  }));
  EXPECT_EQ(repository().Resolve("cmu-smooth-62.5").digest, base_digest_);
}

TEST_F(JobsServiceTest, PruneSaysWhatWouldGoThenRemovesIt) {
  Prepare(Request("a"), RUN_STATUS_UNSTEADY);
  LetDemGo();
  StartJobs({"--settle-s", "0"});
  const Job job = Await(Submitted(Request("a")).job_id(), JOB_STATE_FAILED);
  const auto prune = [&](bool dry_run) {
    grpc::ClientContext context;
    PruneRequest request;
    request.set_dry_run(dry_run);
    request.set_keep_days(1e-9);
    PruneResponse response;
    const auto status = stub_->Prune(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  };
  const auto planned = prune(true);
  EXPECT_EQ(planned.items_count(), 2u) << planned.DebugString();
  EXPECT_EQ(Get(job.job_id()).job_id(), job.job_id());
  EXPECT_EQ(prune(false).items_count(), 2u);
  EXPECT_FALSE(std::filesystem::exists(state_ + "/runs/" + job.run_file()));
  EXPECT_EQ(prune(false).items_count(), 0u);
  grpc::ClientContext context;
  GetJobRequest get;
  get.set_job_id(job.job_id());
  GetJobResponse response;
  EXPECT_EQ(stub_->GetJob(&context, get, &response).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(JobsServiceTest, AJobsOwnTimeLimitEndsItsRun) {
  Prepare(Request("a"));
  StartJobs();
  auto request = Request("a");
  request.mutable_time_limit()->set_seconds(1);
  const Job job = Await(Submitted(request).job_id(), JOB_STATE_FAILED);
  EXPECT_THAT(job.message(), HasSubstr("ran past its time limit"));
  EXPECT_EQ(job.lease_epoch(), 1u) << "what is slow is not tried again";
}

/// Sends raw bytes to a method, returns the first answer's bytes. The packages
/// have no stubs of the two standard services.
std::string CallRaw(const std::string& address, const std::string& method,
                    const std::string& bytes) {
  grpc::GenericStub stub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
  grpc::CompletionQueue queue;
  const auto wait = [&] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  auto call = stub.PrepareCall(&context, method, &queue);
  call->StartCall(nullptr);
  if (!wait()) return "";
  const grpc::Slice slice(bytes);
  call->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
  if (!wait()) return "";
  grpc::ByteBuffer answer;
  call->Read(&answer, nullptr);
  std::string text;
  if (wait()) {
    std::vector<grpc::Slice> slices;
    if (answer.Dump(&slices).ok()) {
      for (const auto& part : slices) text.append(part.begin(), part.end());
    }
  }
  grpc::Status status;
  call->Finish(&status, nullptr);
  wait();
  return text;
}

TEST_F(JobsServiceTest, HealthAndReflectionAnswer) {
  StartJobs({"--reflection"});
  EXPECT_EQ(CallRaw(address_, "/grpc.health.v1.Health/Check", ""), "\x08\x01") << "SERVING";
  // ServerReflectionRequest{list_services: "*"}
  EXPECT_THAT(CallRaw(address_, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                      "\x3a\x01*"),
              HasSubstr("grouser.v1alpha1.JobsService"));
}

TEST_F(JobsServiceTest, DuplicateRequestIsOneJob) {
  Prepare(Request("a"));
  StartJobs();
  const Job job = Submitted(Request("a"));
  EXPECT_EQ(Submitted(Request("a")).job_id(), job.job_id());
  const Job joined = Submitted(Request("b"));
  EXPECT_EQ(joined.job_id(), job.job_id());
  EXPECT_EQ(joined.subscribers(), 2u);
  SubmitRefinementResponse response;
  EXPECT_EQ(Submit(Request("a", 0.1), &response).error_code(), grpc::StatusCode::ALREADY_EXISTS);
  LetDemGo();
  Await(job.job_id(), JOB_STATE_AWAITING_PROMOTION);
  EXPECT_EQ(DemStarts().size(), 1u);
}

TEST_F(JobsServiceTest, CancelStopsTheProcessGroupWhenNobodyIsLeft) {
  Fake("grouser-dem",
       "sleep 1000 & echo $! > \"$bin/child\"; echo $$ >> \"$bin/dem.started\"\n"
       "wait\n");
  StartJobs();
  const Job job = Submitted(Request("a"));
  Submitted(Request("b"));
  ASSERT_TRUE(Eventually([&] { return DemStarts().size() == 1; }));
  const pid_t worker = DemStarts()[0];
  const pid_t child = std::stoi(testing::ReadText(bin_ + "/child"));
  Job now;
  ASSERT_TRUE(Cancel(job.job_id(), "a", &now).ok());
  EXPECT_EQ(now.job_state(), JOB_STATE_RUNNING);
  EXPECT_FALSE(testing::IsDead(worker));
  EXPECT_EQ(Cancel(job.job_id(), "c", &now).error_code(), grpc::StatusCode::NOT_FOUND);
  ASSERT_TRUE(Cancel(job.job_id(), "b", &now).ok());
  EXPECT_EQ(now.job_state(), JOB_STATE_CANCELLED);
  EXPECT_TRUE(Eventually([&] { return testing::IsDead(worker) && testing::IsDead(child); }));
  EXPECT_EQ(Get(job.job_id()).job_state(), JOB_STATE_CANCELLED);
}

TEST_F(JobsServiceTest, BadRequestsGetTheirStatusAndTheServerStaysUp) {
  StartJobs({"--max-queued", "1"});
  const auto code = [&](const SubmitRefinementRequest& request, const char* words) {
    SubmitRefinementResponse response;
    const auto status = Submit(request, &response);
    EXPECT_THAT(status.error_message(), HasSubstr(words));
    return status.error_code();
  };
  auto bad = Request("a");
  bad.mutable_state()->set_load_n(-1);
  EXPECT_EQ(code(bad, "state.load_n"), grpc::StatusCode::INVALID_ARGUMENT);
  bad = Request("a", std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(code(bad, "state.slip"), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(code(Request(""), "request_id"), grpc::StatusCode::INVALID_ARGUMENT);
  bad = Request("a");
  bad.set_model("another");
  EXPECT_EQ(code(bad, "another"), grpc::StatusCode::NOT_FOUND);
  Submitted(Request("a", 0.1));
  ASSERT_TRUE(Eventually([&] { return DemStarts().size() == 1; }));
  Submitted(Request("b", 0.2));
  EXPECT_EQ(code(Request("c", 0.3), "queue"), grpc::StatusCode::RESOURCE_EXHAUSTED);
  Job job;
  EXPECT_EQ(Cancel("job-nowhere", "a", &job).error_code(), grpc::StatusCode::NOT_FOUND);
  grpc::Status end;
  EXPECT_TRUE(Follow(*stub_, "job-nowhere", JOB_STATE_DONE, &end).empty());
  EXPECT_EQ(end.error_code(), grpc::StatusCode::NOT_FOUND);
  grpc::ClientContext context;
  ListJobsResponse list;
  EXPECT_TRUE(stub_->ListJobs(&context, ListJobsRequest(), &list).ok());
  EXPECT_EQ(list.jobs_size(), 2);
}

}  // namespace
}  // namespace grouser::server
