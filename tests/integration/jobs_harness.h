#pragma once

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <sys/types.h>

#include <memory>
#include <string>
#include <vector>

#include "grouser/v1alpha1/jobs_service.grpc.pb.h"
#include "server/core/repository.h"
#include "server/jobs/worker_process.h"
#include "tests/unit/jobs/jobs_fixtures.h"

namespace grouser::server::testing {

/// A state folder with a shipped model, a folder of fake workers (shell
/// scripts that hand out prepared files when told to), and the real
/// grouser-jobs as a process. The fakes are steered by files in bin/:
///   dem.go       grouser-dem run waits for it
///   dem.started  its process id, one line a start
///   gate.json, gate.exit   what grouser-fit gate prints and returns
class JobsTest : public ::testing::Test {
 protected:
  JobsTest();
  ~JobsTest() override;

  /// The run that the fake DEM hands out for a request, and the candidate of
  /// that run that the fake fitter hands out.
  void Prepare(const v1alpha1::SubmitRefinementRequest& request,
               v1alpha1::RunStatus status = v1alpha1::RUN_STATUS_STEADY);
  /// Replaces a fake: a shell script, with $out set to the value of --out.
  void Fake(const std::string& program, const std::string& script);
  void LetDemGo();

  void StartJobs(const std::vector<std::string>& more = {});
  /// Sends the signal and waits for the end.
  WorkerEnd StopJobs(int signal);
  /// Process ids of the DEM workers started so far.
  std::vector<pid_t> DemStarts() const;
  std::string JobsLog() const;

  grpc::Status Submit(const v1alpha1::SubmitRefinementRequest& request,
                      v1alpha1::SubmitRefinementResponse* response);
  /// Must succeed.
  v1alpha1::Job Submitted(const v1alpha1::SubmitRefinementRequest& request);
  v1alpha1::Job Get(const std::string& job_id);
  grpc::Status Cancel(const std::string& job_id, const std::string& request_id, v1alpha1::Job* job);
  grpc::Status Promote(const v1alpha1::PromoteRequest& request,
                       v1alpha1::PromoteResponse* response);
  /// Waits until the job is in that state; fails where it ends otherwise.
  v1alpha1::Job Await(const std::string& job_id, v1alpha1::JobState state);

  Repository repository() const { return Repository(state_, shipped_); }

  TempDir dir_;
  std::string state_ = dir_ / "state", shipped_ = dir_ / "shipped", bin_ = dir_ / "bin";
  std::string base_digest_, address_;
  std::unique_ptr<WorkerProcess> jobs_;
  std::unique_ptr<v1alpha1::JobsService::Stub> stub_;
};

bool IsDead(pid_t pid);

}  // namespace grouser::server::testing
