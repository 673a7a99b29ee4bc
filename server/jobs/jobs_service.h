#pragma once

#include "grouser/v1alpha1/jobs_service.grpc.pb.h"
#include "server/jobs/jobs_app.h"
#include "server/net/access_policy.h"
#include "server/net/call_gate.h"

namespace grouser::server {

/// The gRPC adapter. Its threads only hand requests to the app's serial
/// thread and answers back; none of them waits for a disk.
class JobsServiceAdapter final : public v1alpha1::JobsService::CallbackService {
 public:
  /// All outlive the service.
  JobsServiceAdapter(JobsApp& app, CallGate& gate, AccessPolicy& policy)
      : app_(app), gate_(gate), policy_(policy) {}

  grpc::ServerUnaryReactor* SubmitRefinement(grpc::CallbackServerContext* context,
                                             const v1alpha1::SubmitRefinementRequest* request,
                                             v1alpha1::SubmitRefinementResponse* response) override;
  grpc::ServerUnaryReactor* SubmitCampaign(grpc::CallbackServerContext* context,
                                           const v1alpha1::SubmitCampaignRequest* request,
                                           v1alpha1::SubmitJobResponse* response) override;
  grpc::ServerUnaryReactor* SubmitCalibration(grpc::CallbackServerContext* context,
                                              const v1alpha1::SubmitCalibrationRequest* request,
                                              v1alpha1::SubmitJobResponse* response) override;
  grpc::ServerUnaryReactor* ReadJobFile(grpc::CallbackServerContext* context,
                                        const v1alpha1::ReadJobFileRequest* request,
                                        v1alpha1::ReadJobFileResponse* response) override;
  grpc::ServerUnaryReactor* GetJob(grpc::CallbackServerContext* context,
                                   const v1alpha1::GetJobRequest* request,
                                   v1alpha1::GetJobResponse* response) override;
  grpc::ServerUnaryReactor* ListJobs(grpc::CallbackServerContext* context,
                                     const v1alpha1::ListJobsRequest* request,
                                     v1alpha1::ListJobsResponse* response) override;
  grpc::ServerUnaryReactor* CancelJob(grpc::CallbackServerContext* context,
                                      const v1alpha1::CancelJobRequest* request,
                                      v1alpha1::CancelJobResponse* response) override;
  grpc::ServerUnaryReactor* Promote(grpc::CallbackServerContext* context,
                                    const v1alpha1::PromoteRequest* request,
                                    v1alpha1::PromoteResponse* response) override;
  grpc::ServerUnaryReactor* MoveAlias(grpc::CallbackServerContext* context,
                                      const v1alpha1::MoveAliasRequest* request,
                                      v1alpha1::MoveAliasResponse* response) override;
  grpc::ServerUnaryReactor* RollbackAlias(grpc::CallbackServerContext* context,
                                          const v1alpha1::RollbackAliasRequest* request,
                                          v1alpha1::MoveAliasResponse* response) override;
  grpc::ServerUnaryReactor* ListAliasMoves(grpc::CallbackServerContext* context,
                                           const v1alpha1::ListAliasMovesRequest* request,
                                           v1alpha1::ListAliasMovesResponse* response) override;
  grpc::ServerUnaryReactor* Prune(grpc::CallbackServerContext* context,
                                  const v1alpha1::PruneRequest* request,
                                  v1alpha1::PruneResponse* response) override;
  grpc::ServerWriteReactor<v1alpha1::WatchJobResponse>* WatchJob(
      grpc::CallbackServerContext* context, const v1alpha1::WatchJobRequest* request) override;

 private:
  /// Runs `run` on the serial thread and answers with its outcome. Request and
  /// response live until then.
  template <typename Request, typename Response, typename Run>
  grpc::ServerUnaryReactor* Answer(grpc::CallbackServerContext* context, std::string_view method,
                                   const Request* request, Response* response, Run run);
  /// Hands an admitted call to the serial thread, or refuses it.
  template <typename Task>
  grpc::ServerUnaryReactor* Hand(grpc::CallbackServerContext* context, UnaryCall* call, Task task);
  /// The same for a campaign or calibration, which is answered when it has been checked.
  template <typename Request>
  grpc::ServerUnaryReactor* AnswerWork(grpc::CallbackServerContext* context,
                                       std::string_view method, const Request* request,
                                       v1alpha1::SubmitJobResponse* response);
  /// The same for what moves an alias: `run` is told who asks; against the gate an admin alone may.
  template <typename Request, typename Response, typename Run>
  grpc::ServerUnaryReactor* AnswerMove(grpc::CallbackServerContext* context,
                                       std::string_view method, const Request* request,
                                       Response* response, Run run);

  JobsApp& app_;
  CallGate& gate_;
  AccessPolicy& policy_;
};

}  // namespace grouser::server
