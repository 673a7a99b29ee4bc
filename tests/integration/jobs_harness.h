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
#include "tests/unit/jobs/fake_workers.h"

namespace grouser::server::testing {

/// Fake workers (see there) and the real grouser-jobs as a process.
class JobsTest : public ::testing::Test, protected FakeWorkers {
 protected:
  ~JobsTest() override;

  void StartJobs(const std::vector<std::string>& more = {});
  /// Sends the signal and waits for the end.
  WorkerEnd StopJobs(int signal);
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

  std::string address_;
  std::unique_ptr<WorkerProcess> jobs_;
  std::unique_ptr<v1alpha1::JobsService::Stub> stub_;
};

}  // namespace grouser::server::testing
