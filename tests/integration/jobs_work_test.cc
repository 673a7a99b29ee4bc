// grouser-jobs over gRPC: campaigns and calibrations with fake programs.
#include <signal.h>

#include "server/jobs/job_state.h"
#include "tests/integration/jobs_harness.h"

namespace grouser::server {
namespace {

using namespace v1alpha1;  // NOLINT: states by name
using testing::Eventually;
using ::testing::HasSubstr;
using testing::IsDead;
using ::testing::IsEmpty;
using testing::ReadText;
using testing::WriteText;

/// grouser-dem: `campaign check` says what check.json holds and ends with check.exit; `campaign
/// run` makes a run each start, waits for dem.go, and writes runs.json.
constexpr char kDem[] = R"sh(
case $2 in
  check) while [ -e "$bin/hold.check" ]; do sleep 0.02; done
         cat "$bin/check.json"; [ -e "$bin/check.says" ] && cat "$bin/check.says" >&2
         exit "$(cat "$bin/check.exit")" ;;
  run) cat "$3" >> "$bin/seen.input"; mkdir -p "$out/tiles" && : > "$out/run.$$"
       echo $$ >> "$bin/dem.started"
       echo "progress 0.5 eta=42 1 of 2 runs" >&2
       while [ ! -e "$bin/dem.go" ]; do sleep 0.02; done
       ls "$out" | grep -c '^run\.' > "$out/runs.json"; echo '{}' > "$out/campaign.json" ;;
esac)sh";

class JobsWorkTest : public testing::JobsTest {
 protected:
  JobsWorkTest() {
    Fake("grouser-dem", kDem);
    WriteText(bin_ + "/check.json", R"({"name": "c", "total": 2})");
    WriteText(bin_ + "/check.exit", "0");
  }

  static SubmitCampaignRequest Campaign(const std::string& id,
                                        const std::string& text = "name: c\n") {
    SubmitCampaignRequest request;
    request.set_request_id(id);
    request.mutable_campaign()->set_file("c.yaml");
    auto* file = request.add_files();
    file->set_name("c.yaml");
    file->set_content(text);
    return request;
  }
  grpc::Status Send(const SubmitCampaignRequest& request, SubmitJobResponse* response) {
    grpc::ClientContext context;
    return stub_->SubmitCampaign(&context, request, response);
  }
  Job Accepted(const SubmitCampaignRequest& request) {
    SubmitJobResponse response;
    const auto status = Send(request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.job();
  }
  Job Running(const SubmitCampaignRequest& request) {
    const std::size_t before = DemStarts().size();
    const Job job = Accepted(request);
    EXPECT_TRUE(Eventually([&] { return DemStarts().size() == before + 1; }));
    return job;
  }
  std::string Fetched(const Job& job, const std::string& name) {
    ReadJobFileRequest request;
    request.set_job_id(job.job_id());
    request.set_name(name);
    grpc::ClientContext context;
    ReadJobFileResponse response;
    const auto status = stub_->ReadJobFile(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.data();
  }
  std::vector<std::string> JobFolders() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(state_ + "/jobs")) {
      if (entry.is_directory()) names.push_back(entry.path().filename().string());
    }
    return names;
  }
};

TEST_F(JobsWorkTest, ACampaignRunsAndItsResultsAreRead) {
  StartJobs();
  const Job job = Running(Campaign("a"));
  EXPECT_EQ(job.campaign().runs(), 2u);
  EXPECT_EQ(ReadText(bin_ + "/seen.input"), "name: c\n");
  ASSERT_TRUE(Eventually([&] { return Get(job.job_id()).message() == "1 of 2 runs"; }));
  EXPECT_EQ(Get(job.job_id()).eta().seconds(), 42) << "as the program expects";
  EXPECT_EQ(Get(job.job_id()).progress(), 0.5);
  SubmitJobResponse same;
  ASSERT_TRUE(Send(Campaign("b"), &same).ok());
  EXPECT_TRUE(same.joined());
  EXPECT_EQ(same.job().job_id(), job.job_id());
  EXPECT_EQ(Accepted(Campaign("a")).job_id(), job.job_id()) << "idempotent";
  EXPECT_EQ(Send(Campaign("a", "name: d\n"), &same).error_code(), grpc::StatusCode::ALREADY_EXISTS);
  LetDemGo();
  const Job done = Await(job.job_id(), JOB_STATE_DONE);
  ASSERT_EQ(done.results_size(), 2) << done.DebugString();
  EXPECT_EQ(Fetched(done, "runs.json"), "1\n");
  EXPECT_THAT(JobFolders(), ::testing::ElementsAre(job.job_id())) << "checks leave nothing";
  EXPECT_TRUE(Eventually(
      [&] { return !std::filesystem::exists(state_ + "/jobs/" + job.job_id() + "/out/tiles"); }));
  PromoteRequest promotion;
  promotion.set_job_id(job.job_id());
  promotion.set_who("a");
  promotion.set_why("b");
  PromoteResponse promoted;
  EXPECT_EQ(Promote(promotion, &promoted).error_code(), grpc::StatusCode::FAILED_PRECONDITION);
}

TEST_F(JobsWorkTest, WhatTheProgramRefusesIsNoJob) {
  StartJobs({"--max-campaign-runs", "100"});
  WriteText(bin_ + "/check.exit", "2");
  WriteText(bin_ + "/check.says", "grouser-dem: input/c.yaml:1: key 'seeds': no such key\n");
  SubmitJobResponse response;
  auto status = Send(Campaign("a"), &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("input/c.yaml:1: key 'seeds'"));
  WriteText(bin_ + "/check.exit", "0");
  WriteText(bin_ + "/check.json", R"({"name": "c", "total": 101})");
  status = Send(Campaign("b"), &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(status.error_message(), HasSubstr("101 runs, expected at most 100"));
  WriteText(bin_ + "/check.json", "no JSON");
  EXPECT_FALSE(Send(Campaign("c"), &response).ok());
  auto bad = Campaign("d");
  bad.mutable_files(0)->set_name("../c.yaml");
  EXPECT_EQ(Send(bad, &response).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  grpc::ClientContext context;
  ListJobsResponse list;
  ASSERT_TRUE(stub_->ListJobs(&context, {}, &list).ok());
  EXPECT_EQ(list.jobs_size(), 0);
  EXPECT_THAT(JobFolders(), IsEmpty());
}

TEST_F(JobsWorkTest, ChecksAtATimeAreBoundedAndEndWithTheProgram) {
  WriteText(bin_ + "/hold.check", "");
  StartJobs();
  constexpr int kSent = 6;
  std::vector<grpc::Status> ends(kSent);
  std::vector<std::thread> threads;
  std::atomic<int> refused{0};
  for (int i = 0; i < kSent; ++i) {
    threads.emplace_back([&, i] {
      SubmitJobResponse response;
      ends[i] = Send(Campaign("r" + std::to_string(i), "name: " + std::to_string(i)), &response);
      refused += ends[i].error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED;
    });
  }
  EXPECT_TRUE(Eventually([&] { return refused == 2; })) << "four of a client";
  EXPECT_EQ(StopJobs(SIGTERM).exit_code, 0);
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(
      std::ranges::count_if(
          ends, [](const auto& end) { return end.error_code() == grpc::StatusCode::UNAVAILABLE; }),
      4);
  std::filesystem::remove(bin_ + "/hold.check");
  StartJobs();
  EXPECT_THAT(JobFolders(), IsEmpty());
}

TEST_F(JobsWorkTest, KilledItGoesOnInItsFolder) {
  StartJobs();
  const Job job = Running(Campaign("a"));
  const pid_t worker = DemStarts()[0];
  EXPECT_EQ(StopJobs(SIGKILL).signal, SIGKILL);
  EXPECT_TRUE(Eventually([&] { return IsDead(worker); })) << "it dies with its parent";
  LetDemGo();
  StartJobs();
  const Job done = Await(job.job_id(), JOB_STATE_DONE);
  EXPECT_EQ(Fetched(done, "runs.json"), "2\n") << "what the first start left is there";
  EXPECT_EQ(DemStarts().size(), 2u);
  EXPECT_EQ(Accepted(Campaign("a")).job_id(), job.job_id());
}

TEST_F(JobsWorkTest, CancelTimeLimitAndDiskLimitEndIt) {
  StartJobs({"--max-job-mb", "1"});
  const Job job = Running(Campaign("a"));
  Job now;
  ASSERT_TRUE(Cancel(job.job_id(), "a", &now).ok());
  EXPECT_EQ(now.job_state(), JOB_STATE_CANCELLED);
  EXPECT_TRUE(Eventually([&] { return IsDead(DemStarts()[0]); }));

  auto brief = Campaign("b");
  brief.mutable_time_limit()->set_seconds(1);
  EXPECT_THAT(Await(Accepted(brief).job_id(), JOB_STATE_FAILED).message(),
              HasSubstr("ran past its time limit"));

  Fake("grouser-dem", R"sh(
    case $2 in
      check) cat "$bin/check.json" ;;
      run) head -c 2000000 /dev/zero > "$out/large"; echo '{}' > "$out/runs.json"; sleep 1000 ;;
    esac)sh");
  const Job large = Await(Accepted(Campaign("c")).job_id(), JOB_STATE_FAILED);
  EXPECT_THAT(large.message(), HasSubstr("allowed are 1.0"));
  EXPECT_EQ(large.lease_epoch(), 1u) << "not tried again";
  EXPECT_EQ(large.results_size(), 1) << "what is there can be had";
}

TEST_F(JobsWorkTest, IsPrunedOnceItHasEnded) {
  StartJobs({"--settle-s", "0"});
  const Job job = Running(Campaign("a"));
  const auto prune = [&] {
    grpc::ClientContext context;
    PruneRequest request;
    request.set_keep_days(1e-9);
    PruneResponse response;
    const auto status = stub_->Prune(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.items_count();
  };
  EXPECT_EQ(prune(), 0u) << "an open job has no model, and keeps its folder";
  LetDemGo();
  Await(job.job_id(), JOB_STATE_DONE);
  EXPECT_EQ(prune(), 1u);
  EXPECT_THAT(JobFolders(), IsEmpty());
}

TEST_F(JobsWorkTest, ACampaignOfTheOperatorsFolder) {
  const std::string folder = dir_ / "campaigns";
  std::filesystem::create_directory(folder);
  WriteText(folder + "/mine.yaml", "name: mine\n");
  WriteText(folder + "/a.scene.yaml", "name: scene\n");
  LetDemGo();
  StartJobs({"--campaigns", folder});
  SubmitCampaignRequest request;
  request.set_request_id("a");
  request.mutable_campaign()->set_file("mine.yaml");
  request.mutable_campaign()->set_from_server(true);
  Await(Accepted(request).job_id(), JOB_STATE_DONE);
  EXPECT_EQ(ReadText(bin_ + "/seen.input"), "name: mine\n");
  auto with_scene = Campaign("b");
  with_scene.mutable_campaign()->add_server_files("a.scene.yaml");
  const Job job = Await(Accepted(with_scene).job_id(), JOB_STATE_DONE);
  EXPECT_EQ(ReadText(state_ + "/jobs/" + job.job_id() + "/input/a.scene.yaml"), "name: scene\n");
}

TEST_F(JobsWorkTest, GrainsAreCalibratedByTheScript) {
  Fake("grouser-calibrate", "exit 0");
  const std::string scripts = dir_ / "checkout/dem_offline/calibrate_grains";
  std::filesystem::create_directories(scripts);
  WriteText(scripts + "/calibrate_grains.py", R"py(
import os, sys
if "--dry-run" in sys.argv:
    text = open(sys.argv[sys.argv.index("--vary") + 1]).read()
    sys.exit(2 if print(text, file=sys.stderr) or "bad" in text else 0)
out = sys.argv[sys.argv.index("--out") + 1]
print("progress 0.5 eta=3600 10 of 20 points", file=sys.stderr, flush=True)
open(os.path.join(out, "calibration.json"), "w").write(" ".join(sys.argv[1:]))
)py");
  StartJobs({"--scripts", dir_ / "checkout", "--work-parallel", "3"});
  SubmitCalibrationRequest request;
  request.set_request_id("a");
  auto* work = request.mutable_calibration();
  work->set_kind(CALIBRATION_KIND_GRAINS);
  work->set_data("m.yaml");
  work->set_soil("s.yaml");
  work->set_scene("c.yaml");
  work->set_vary("v.yaml");
  work->set_budget_hours(1.5);
  for (const char* name : {"m.yaml", "s.yaml", "c.yaml", "v.yaml"}) {
    auto* file = request.add_files();
    file->set_name(name);
    file->set_content("bad\n");
  }
  const auto send = [&](SubmitJobResponse* response) {
    grpc::ClientContext context;
    return stub_->SubmitCalibration(&context, request, response);
  };
  SubmitJobResponse response;
  auto status = send(&response);
  if (status.error_code() == grpc::StatusCode::FAILED_PRECONDITION) {
    EXPECT_THAT(status.error_message(), HasSubstr("expected Python modules"));
    GTEST_SKIP() << status.error_message();
  }
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
  request.mutable_files(3)->set_content("good\n");
  status = send(&response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  const Job done = Await(response.job().job_id(), JOB_STATE_DONE);
  EXPECT_EQ(Fetched(done, "calibration.json"),
            "input/m.yaml --soil input/s.yaml --scene input/c.yaml --budget 1.5 --jobs 3 --bin " +
                bin_ + " --out out --vary input/v.yaml --progress-lines --wait 600");
}

}  // namespace
}  // namespace grouser::server
