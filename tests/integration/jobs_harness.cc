#include "tests/integration/jobs_harness.h"

#include <signal.h>

#include "server/jobs/job_state.h"

namespace grouser::server::testing {
JobsTest::~JobsTest() {
  if (HasFailure()) std::fprintf(stderr, "--- log of grouser-jobs\n%s---\n", JobsLog().c_str());
  if (jobs_ != nullptr) StopJobs(SIGKILL);
  for (const pid_t pid : DemStarts()) {
    if (!IsDead(pid)) ::kill(-pid, SIGKILL);  // only after a failure
  }
}

void JobsTest::StartJobs(const std::vector<std::string>& more) {
  const std::string port_file = dir_ / "port";
  std::filesystem::remove(port_file);
  WorkerCommand command;
  command.argv = {GROUSER_JOBS_PROGRAM,
                  "--state",
                  state_,
                  "--shipped",
                  shipped_,
                  "--bin",
                  bin_,
                  "--grpc",
                  "127.0.0.1:0",
                  "--port-file",
                  port_file,
                  "--grace-s",
                  "30"};
  command.argv.insert(command.argv.end(), more.begin(), more.end());
  command.folder = dir_.path();
  command.stdout_path = dir_ / "jobs.stdout";
  command.log_path = dir_ / "jobs.log";
  command.limits.memory_bytes = 0;
  jobs_ = std::make_unique<WorkerProcess>(WorkerProcess::Spawn(std::move(command)));
  ASSERT_TRUE(
      Eventually([&] { return std::filesystem::exists(port_file) || IsDead(jobs_->pid()); }));
  ASSERT_TRUE(std::filesystem::exists(port_file)) << JobsLog();
  address_ = ReadText(port_file);
  ASSERT_TRUE(address_.starts_with("grpc=")) << address_;
  address_ = address_.substr(5, address_.find('\n') - 5);
  stub_ = v1alpha1::JobsService::NewStub(
      grpc::CreateChannel(address_, grpc::InsecureChannelCredentials()));
}

WorkerEnd JobsTest::StopJobs(int signal) {
  ::kill(jobs_->pid(), signal);
  const WorkerEnd end = jobs_->Reap();
  jobs_.reset();
  return end;
}

std::string JobsTest::JobsLog() const { return ReadText(dir_ / "jobs.log"); }

grpc::Status JobsTest::Submit(const v1alpha1::SubmitRefinementRequest& request,
                              v1alpha1::SubmitRefinementResponse* response) {
  grpc::ClientContext context;
  return stub_->SubmitRefinement(&context, request, response);
}

v1alpha1::Job JobsTest::Submitted(const v1alpha1::SubmitRefinementRequest& request) {
  v1alpha1::SubmitRefinementResponse response;
  const auto status = Submit(request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.job();
}

v1alpha1::Job JobsTest::Get(const std::string& job_id) {
  grpc::ClientContext context;
  v1alpha1::GetJobRequest request;
  request.set_job_id(job_id);
  v1alpha1::GetJobResponse response;
  const auto status = stub_->GetJob(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.job();
}

grpc::Status JobsTest::Cancel(const std::string& job_id, const std::string& request_id,
                              v1alpha1::Job* job) {
  grpc::ClientContext context;
  v1alpha1::CancelJobRequest request;
  request.set_job_id(job_id);
  request.set_request_id(request_id);
  v1alpha1::CancelJobResponse response;
  const auto status = stub_->CancelJob(&context, request, &response);
  *job = response.job();
  return status;
}

grpc::Status JobsTest::Promote(const v1alpha1::PromoteRequest& request,
                               v1alpha1::PromoteResponse* response) {
  grpc::ClientContext context;
  return stub_->Promote(&context, request, response);
}

v1alpha1::Job JobsTest::Await(const std::string& job_id, v1alpha1::JobState state) {
  v1alpha1::Job job;
  EXPECT_TRUE(Eventually([&] {
    job = Get(job_id);
    return job.job_state() == state || HasEnded(job.job_state());
  })) << "stays "
      << ShortName(job.job_state());
  EXPECT_EQ(ShortName(job.job_state()), ShortName(state)) << job.message();
  return job;
}

}  // namespace grouser::server::testing
