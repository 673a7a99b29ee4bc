#include "server/jobs/jobs_service.h"

#include <sqlite3.h>

#include <stdexcept>
#include <string>

#include "proto/records/os/no_space.h"
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
    return {
        e.getErrorCode() == SQLITE_FULL ? StatusCode::kResourceExhausted : StatusCode::kUnavailable,
        std::string("nothing was changed: job store: ") + e.what()};
  } catch (const os::NoSpace& e) {
    return {StatusCode::kResourceExhausted, e.what()};
  } catch (const std::exception& e) {
    return {StatusCode::kInternal, e.what()};
  }
}

}  // namespace

template <typename Request, typename Response, typename Run>
grpc::ServerUnaryReactor* JobsServiceAdapter::Answer(grpc::CallbackServerContext* context,
                                                     std::string_view method,
                                                     const Request* request, Response* response,
                                                     Run run) {
  auto* call = new UnaryCall(gate_, *context, method, *request);
  return Hand(context, call, [call, context, response, run] {
    const auto status =
        context->IsCancelled() ? grpc::Status::CANCELLED : ToGrpcStatus(StatusOf(run));
    call->FinishWith(status, *response);
  });
}

template <typename Task>
grpc::ServerUnaryReactor* JobsServiceAdapter::Hand(grpc::CallbackServerContext* context,
                                                   UnaryCall* call, Task task) {
  if (!call->admitted()) return call;
  if (!app_.thread().TryPost(std::move(task))) {
    HintRetry(*context);
    gate_.records().Refused(Refusal::kQueueFull);
    call->Finish(ToGrpcStatus(kBusy));
  }
  return call;
}

template <typename Request>
grpc::ServerUnaryReactor* JobsServiceAdapter::AnswerWork(grpc::CallbackServerContext* context,
                                                         std::string_view method,
                                                         const Request* request,
                                                         v1alpha1::SubmitJobResponse* response) {
  auto* call = new UnaryCall(gate_, *context, method, *request);
  const std::string who = policy_.CallerOf(*context).name;
  return Hand(context, call, [this, call, context, request, response, who] {
    const auto finish = [call, response](std::exception_ptr problem, const auto& submitted) {
      const Status status = StatusOf([&] {
        if (problem) std::rethrow_exception(problem);
        *response = submitted;
      });
      call->FinishWith(ToGrpcStatus(status), *response);
    };
    if (context->IsCancelled()) {
      call->FinishWith(grpc::Status::CANCELLED, *response);
      return;
    }
    try {
      app_.SubmitWork(WorkOf(*request), who, finish);
    } catch (...) {
      finish(std::current_exception(), *response);
    }
  });
}

template <typename Request, typename Response, typename Run>
grpc::ServerUnaryReactor* JobsServiceAdapter::AnswerMove(grpc::CallbackServerContext* context,
                                                         std::string_view method,
                                                         const Request* request, Response* response,
                                                         Run run) {
  const Caller caller = policy_.CallerOf(*context);
  if (request->override_gate()) {
    const auto status =
        AccessPolicy::Require(caller, Role::kAdmin, std::string(method) + " with override_gate");
    if (!status.ok()) {
      return AnswerNow(gate_, *context, method, *request, *response, [&] { return status; });
    }
  }
  return Answer(context, method, request, response, [run, who = caller.name] { run(who); });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::SubmitRefinement(
    grpc::CallbackServerContext* context, const v1alpha1::SubmitRefinementRequest* request,
    v1alpha1::SubmitRefinementResponse* response) {
  return Answer(context, "JobsService/SubmitRefinement", request, response,
                [this, request, response, who = policy_.CallerOf(*context).name] {
                  *response = app_.Submit(*request, who);
                });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::SubmitCampaign(
    grpc::CallbackServerContext* context, const v1alpha1::SubmitCampaignRequest* request,
    v1alpha1::SubmitJobResponse* response) {
  return AnswerWork(context, "JobsService/SubmitCampaign", request, response);
}

grpc::ServerUnaryReactor* JobsServiceAdapter::SubmitCalibration(
    grpc::CallbackServerContext* context, const v1alpha1::SubmitCalibrationRequest* request,
    v1alpha1::SubmitJobResponse* response) {
  return AnswerWork(context, "JobsService/SubmitCalibration", request, response);
}

grpc::ServerUnaryReactor* JobsServiceAdapter::ReadJobFile(
    grpc::CallbackServerContext* context, const v1alpha1::ReadJobFileRequest* request,
    v1alpha1::ReadJobFileResponse* response) {
  return Answer(context, "JobsService/ReadJobFile", request, response,
                [this, request, response] { *response = app_.ReadFile(*request); });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::GetJob(grpc::CallbackServerContext* context,
                                                     const v1alpha1::GetJobRequest* request,
                                                     v1alpha1::GetJobResponse* response) {
  return Answer(context, "JobsService/GetJob", request, response,
                [this, request, response] { *response = app_.Get(*request); });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::ListJobs(grpc::CallbackServerContext* context,
                                                       const v1alpha1::ListJobsRequest* request,
                                                       v1alpha1::ListJobsResponse* response) {
  return Answer(context, "JobsService/ListJobs", request, response,
                [this, request, response] { *response = app_.List(*request); });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::CancelJob(grpc::CallbackServerContext* context,
                                                        const v1alpha1::CancelJobRequest* request,
                                                        v1alpha1::CancelJobResponse* response) {
  return Answer(context, "JobsService/CancelJob", request, response,
                [this, request, response] { *response = app_.Cancel(*request); });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::Promote(grpc::CallbackServerContext* context,
                                                      const v1alpha1::PromoteRequest* request,
                                                      v1alpha1::PromoteResponse* response) {
  return AnswerMove(context, "JobsService/Promote", request, response,
                    [this, request, response](const std::string& who) {
                      *response = app_.Promote(*request, who);
                    });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::MoveAlias(grpc::CallbackServerContext* context,
                                                        const v1alpha1::MoveAliasRequest* request,
                                                        v1alpha1::MoveAliasResponse* response) {
  return AnswerMove(
      context, "JobsService/MoveAlias", request, response,
      [this, request, response](const std::string& who) { *response = app_.Move(*request, who); });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::RollbackAlias(
    grpc::CallbackServerContext* context, const v1alpha1::RollbackAliasRequest* request,
    v1alpha1::MoveAliasResponse* response) {
  return Answer(context, "JobsService/RollbackAlias", request, response,
                [this, request, response, who = policy_.CallerOf(*context).name] {
                  *response = app_.Rollback(*request, who);
                });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::ListAliasMoves(
    grpc::CallbackServerContext* context, const v1alpha1::ListAliasMovesRequest* request,
    v1alpha1::ListAliasMovesResponse* response) {
  return Answer(context, "JobsService/ListAliasMoves", request, response,
                [this, request, response] { *response = app_.ListMoves(*request); });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::Prune(grpc::CallbackServerContext* context,
                                                    const v1alpha1::PruneRequest* request,
                                                    v1alpha1::PruneResponse* response) {
  return Answer(context, "JobsService/Prune", request, response,
                [this, request, response] { *response = app_.Prune(*request); });
}

grpc::ServerWriteReactor<v1alpha1::WatchJobResponse>* JobsServiceAdapter::WatchJob(
    grpc::CallbackServerContext* context, const v1alpha1::WatchJobRequest* request) {
  const auto reactor = WatchReactor::Create(gate_, *context);
  // A copy: the stream may be cancelled, and the request gone, before its turn.
  const auto refuse = [&](Refusal reason, const grpc::Status& status) {
    gate_.records().Refused(reason);
    reactor->End(status);  // where a drain has not ended it already
    gate_.Leave();
  };
  if (!gate_.Enter()) {
    refuse(Refusal::kDraining, ShuttingDown());
    return reactor.get();
  }
  const bool taken = app_.thread().TryPost([this, reactor, request = *request] {
    const Status status = StatusOf([&] { app_.Watch(request, reactor); });
    if (!status.ok()) reactor->End(ToGrpcStatus(status));
    gate_.Leave();
  });
  if (!taken) {
    HintRetry(*context);  // gRPC ends no stream before it is returned
    refuse(Refusal::kQueueFull, ToGrpcStatus(kBusy));
  }
  return reactor.get();
}

}  // namespace grouser::server
