#include "clients/cpp/jobs_client.h"

#include <grpcpp/client_context.h>

#include <utility>

#include "clients/cpp/client_error.h"

namespace grouser::client {
namespace {

using Stub = v1alpha1::JobsService::Stub;

}  // namespace

JobsClient::JobsClient(Server server, Milliseconds deadline)
    : server_(std::move(server)),
      deadline_(deadline),
      stub_(v1alpha1::JobsService::NewStub(MakeChannel(server_))) {}

v1alpha1::SubmitRefinementResponse JobsClient::Submit(
    const v1alpha1::SubmitRefinementRequest& request) const {
  return Call(*stub_, &Stub::SubmitRefinement, request, server_, deadline_);
}

v1alpha1::SubmitJobResponse JobsClient::Submit(
    const v1alpha1::SubmitCampaignRequest& request) const {
  return Call(*stub_, &Stub::SubmitCampaign, request, server_, deadline_);
}

v1alpha1::SubmitJobResponse JobsClient::Submit(
    const v1alpha1::SubmitCalibrationRequest& request) const {
  return Call(*stub_, &Stub::SubmitCalibration, request, server_, deadline_);
}

void JobsClient::ReadFile(const std::string& job_id, const std::string& name,
                          const std::function<void(const std::string&)>& take) const {
  v1alpha1::ReadJobFileRequest request;
  request.set_job_id(job_id);
  request.set_name(name);
  while (true) {
    const auto part = Call(*stub_, &Stub::ReadJobFile, request, server_, deadline_);
    if (part.data().empty()) return;
    take(part.data());
    request.set_offset(request.offset() + part.data().size());
    if (request.offset() >= part.bytes()) return;
  }
}

v1alpha1::Job JobsClient::Get(const std::string& job_id) const {
  v1alpha1::GetJobRequest request;
  request.set_job_id(job_id);
  return Call(*stub_, &Stub::GetJob, request, server_, deadline_).job();
}

v1alpha1::ListJobsResponse JobsClient::List(int limit) const {
  v1alpha1::ListJobsResponse all;
  v1alpha1::ListJobsRequest request;
  do {
    request.set_page_size(limit - all.jobs_size());
    const auto page = Call(*stub_, &Stub::ListJobs, request, server_, deadline_);
    request.set_page_token(page.next_page_token());
    all.MergeFrom(page);
  } while (!request.page_token().empty() && all.jobs_size() < limit);
  all.clear_next_page_token();
  return all;
}

v1alpha1::Job JobsClient::Watch(const std::string& job_id,
                                const std::function<bool(const v1alpha1::Job&)>& on_change) const {
  v1alpha1::WatchJobRequest request;
  request.set_job_id(job_id);
  grpc::ClientContext context;
  const auto reader = stub_->WatchJob(&context, request);
  v1alpha1::WatchJobResponse response;
  bool stopped_here = false;
  while (!stopped_here && reader->Read(&response)) stopped_here = !on_change(response.job());
  if (stopped_here) context.TryCancel();
  const grpc::Status status = reader->Finish();
  if (!stopped_here) ThrowUnlessOk(status, server_, &context);
  return std::move(*response.mutable_job());
}

v1alpha1::Job JobsClient::Cancel(const std::string& job_id, const std::string& request_id) const {
  v1alpha1::CancelJobRequest request;
  request.set_job_id(job_id);
  request.set_request_id(request_id);
  return Call(*stub_, &Stub::CancelJob, request, server_, deadline_).job();
}

v1alpha1::PromoteResponse JobsClient::Promote(const v1alpha1::PromoteRequest& request) const {
  return Call(*stub_, &Stub::Promote, request, server_, deadline_);
}

v1alpha1::AliasMove JobsClient::MoveAlias(const v1alpha1::MoveAliasRequest& request) const {
  return Call(*stub_, &Stub::MoveAlias, request, server_, deadline_).move();
}

v1alpha1::AliasMove JobsClient::RollbackAlias(const v1alpha1::RollbackAliasRequest& request) const {
  return Call(*stub_, &Stub::RollbackAlias, request, server_, deadline_).move();
}

v1alpha1::ListAliasMovesResponse JobsClient::ListAliasMoves(const std::string& model,
                                                            int limit) const {
  v1alpha1::ListAliasMovesResponse all;
  v1alpha1::ListAliasMovesRequest request;
  request.set_model(model);
  do {
    request.set_page_size(limit - all.moves_size());
    const auto page = Call(*stub_, &Stub::ListAliasMoves, request, server_, deadline_);
    request.set_page_token(page.next_page_token());
    all.MergeFrom(page);
  } while (!request.page_token().empty() && all.moves_size() < limit);
  all.clear_next_page_token();
  return all;
}

v1alpha1::PruneResponse JobsClient::Prune(const v1alpha1::PruneRequest& request) const {
  return Call(*stub_, &Stub::Prune, request, server_, deadline_);
}

}  // namespace grouser::client
