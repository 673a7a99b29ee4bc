#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "clients/cpp/channel.h"
#include "grouser/v1alpha1/jobs_service.grpc.pb.h"

namespace grouser::client {

/// Jobs; thread-safe. Every call throws ClientError with status and
/// text when it fails. Meaning of the messages: jobs_service.proto.
class JobsClient {
 public:
  /// Throws as MakeCredentials.
  explicit JobsClient(Server server, Milliseconds deadline = Milliseconds(10000));

  v1alpha1::SubmitRefinementResponse Submit(const v1alpha1::SubmitRefinementRequest& request) const;
  v1alpha1::SubmitJobResponse Submit(const v1alpha1::SubmitCampaignRequest& request) const;
  v1alpha1::SubmitJobResponse Submit(const v1alpha1::SubmitCalibrationRequest& request) const;
  /// A result of a job, whole, in as many calls as that takes. `take` gets its parts in order.
  void ReadFile(const std::string& job_id, const std::string& name,
                const std::function<void(const std::string&)>& take) const;
  v1alpha1::Job Get(const std::string& job_id) const;
  /// The newest jobs, at most `limit`, of as many pages as that takes.
  v1alpha1::ListJobsResponse List(int limit) const;
  /// Calls `on_change` with the present state and every change until the job
  /// has ended or `on_change` returns false; returns the last state. No
  /// deadline: DEM takes its time.
  v1alpha1::Job Watch(const std::string& job_id,
                      const std::function<bool(const v1alpha1::Job&)>& on_change) const;
  v1alpha1::Job Cancel(const std::string& job_id, const std::string& request_id) const;
  v1alpha1::PromoteResponse Promote(const v1alpha1::PromoteRequest& request) const;
  v1alpha1::AliasMove MoveAlias(const v1alpha1::MoveAliasRequest& request) const;
  v1alpha1::AliasMove RollbackAlias(const v1alpha1::RollbackAliasRequest& request) const;
  /// The newest moves of "name", "name@alias" or (empty) all, at most `limit`.
  v1alpha1::ListAliasMovesResponse ListAliasMoves(const std::string& model, int limit) const;
  v1alpha1::PruneResponse Prune(const v1alpha1::PruneRequest& request) const;

 private:
  Server server_;
  Milliseconds deadline_;
  std::unique_ptr<v1alpha1::JobsService::Stub> stub_;
};

}  // namespace grouser::client
