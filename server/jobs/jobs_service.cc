#include "server/jobs/jobs_service.h"

#include <spdlog/spdlog.h>
#include <sqlite3.h>

#include <stdexcept>
#include <string>

#include "server/jobs/watch_reactor.h"
#include "server/net/grpc_status.h"

namespace grouser::server {
namespace {

const Status kBusy{StatusCode::kResourceExhausted,
                   "requests: " + std::to_string(SerialThread::kMaxWaiting) +
                       " wait already, expected fewer; try again later"};

/// What went wrong, as a status.
template <typename Request>
Status StatusOf(const Request& run) {
  try {
    run();
    return Status::Ok();
  } catch (const StatusError& e) {
    return e.status();
  } catch (const SqliteError& e) {
    spdlog::error("job store: {}", e.what());
    return {
        e.getErrorCode() == SQLITE_FULL ? StatusCode::kResourceExhausted : StatusCode::kUnavailable,
        std::string("nothing was changed: job store: ") + e.what()};
  } catch (const std::exception& e) {
    spdlog::error("{}", e.what());
    return {StatusCode::kInternal, e.what()};
  }
}

}  // namespace

template <typename Run>
grpc::ServerUnaryReactor* JobsServiceAdapter::Answer(grpc::CallbackServerContext* context,
                                                     Run run) {
  auto* call = new UnaryCall(gate_, *context);
  if (!call->admitted()) return call;
  const bool taken = app_.thread().TryPost([call, context, run] {
    call->Finish(context->IsCancelled() ? grpc::Status::CANCELLED : ToGrpcStatus(StatusOf(run)));
  });
  if (!taken) call->Finish(ToGrpcStatus(kBusy));
  return call;
}

grpc::ServerUnaryReactor* JobsServiceAdapter::SubmitRefinement(
    grpc::CallbackServerContext* context, const v1alpha1::SubmitRefinementRequest* request,
    v1alpha1::SubmitRefinementResponse* response) {
  return Answer(context, [this, request, response, who = policy_.CallerOf(*context).name] {
    *response = app_.Submit(*request, who);
  });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::GetJob(grpc::CallbackServerContext* context,
                                                     const v1alpha1::GetJobRequest* request,
                                                     v1alpha1::GetJobResponse* response) {
  return Answer(context, [this, request, response] { *response = app_.Get(*request); });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::ListJobs(grpc::CallbackServerContext* context,
                                                       const v1alpha1::ListJobsRequest* request,
                                                       v1alpha1::ListJobsResponse* response) {
  return Answer(context, [this, request, response] { *response = app_.List(*request); });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::CancelJob(grpc::CallbackServerContext* context,
                                                        const v1alpha1::CancelJobRequest* request,
                                                        v1alpha1::CancelJobResponse* response) {
  return Answer(context, [this, request, response] { *response = app_.Cancel(*request); });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::Promote(grpc::CallbackServerContext* context,
                                                      const v1alpha1::PromoteRequest* request,
                                                      v1alpha1::PromoteResponse* response) {
  const Caller caller = policy_.CallerOf(*context);
  if (request->override_gate()) {
    const auto status = AccessPolicy::Require(caller, Role::kAdmin, "Promote with override_gate");
    if (!status.ok()) return AnswerNow(gate_, *context, [&] { return status; });
  }
  return Answer(context, [this, request, response, who = caller.name] {
    *response = app_.Promote(*request, who);
  });
}

grpc::ServerWriteReactor<v1alpha1::WatchJobResponse>* JobsServiceAdapter::WatchJob(
    grpc::CallbackServerContext*, const v1alpha1::WatchJobRequest* request) {
  const auto reactor = WatchReactor::Create(gate_);
  // A copy: the stream may be cancelled, and the request gone, before its turn.
  const bool taken = gate_.Enter() && app_.thread().TryPost([this, reactor, request = *request] {
    const Status status = StatusOf([&] { app_.Watch(request, reactor); });
    if (!status.ok()) reactor->End(ToGrpcStatus(status));
    gate_.Leave();
  });
  if (!taken) {
    reactor->End(ToGrpcStatus(kBusy));  // where a drain has not ended it already
    gate_.Leave();
  }
  return reactor.get();
}

}  // namespace grouser::server
