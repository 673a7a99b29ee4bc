#pragma once

#include <memory>
#include <string>

#include "grouser/v1alpha1/jobs_service.grpc.pb.h"
#include "server/jobs/jobs_app.h"

namespace grouser::server {

/// The gRPC adapter. Its threads only hand requests to the app's serial
/// thread and answers back; none of them waits for a disk.
class JobsServiceAdapter final : public v1alpha1::JobsService::CallbackService {
 public:
  explicit JobsServiceAdapter(JobsApp& app) : app_(app) {}

  grpc::ServerUnaryReactor* SubmitRefinement(grpc::CallbackServerContext* context,
                                             const v1alpha1::SubmitRefinementRequest* request,
                                             v1alpha1::SubmitRefinementResponse* response) override;
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
  grpc::ServerWriteReactor<v1alpha1::WatchJobResponse>* WatchJob(
      grpc::CallbackServerContext* context, const v1alpha1::WatchJobRequest* request) override;

 private:
  JobsApp& app_;
};

/// The service on an address, with health and reflection.
class JobsServer {
 public:
  /// Throws std::runtime_error where the address cannot be had.
  JobsServer(JobsApp& app, const std::string& address);
  ~JobsServer();

  /// The address with the port that was got.
  const std::string& address() const { return address_; }
  /// Lets calls under way end, cancels them after `drain_s`.
  void Shutdown(double drain_s);

 private:
  JobsServiceAdapter adapter_;
  std::string address_;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace grouser::server
