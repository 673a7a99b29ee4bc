#include "server/jobs/jobs_service.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <spdlog/spdlog.h>
#include <sqlite3.h>

#include <chrono>
#include <stdexcept>

#include "server/jobs/request_error.h"
#include "server/jobs/watch_reactor.h"

namespace grouser::server {
namespace {

constexpr int kMaxReceiveBytes = 256 * 1024;  // requests are small

const grpc::Status kBusy(grpc::StatusCode::RESOURCE_EXHAUSTED,
                         "too many requests wait; try again later");

/// The one place where a gRPC status is made of what went wrong.
template <typename Request>
grpc::Status StatusOf(const Request& run) {
  try {
    run();
    return grpc::Status::OK;
  } catch (const RequestError& e) {
    return {static_cast<grpc::StatusCode>(e.code()), e.what()};
  } catch (const SqliteError& e) {
    spdlog::error("job store: {}", e.what());
    return {e.getErrorCode() == SQLITE_FULL ? grpc::StatusCode::RESOURCE_EXHAUSTED : grpc::StatusCode::UNAVAILABLE,
            std::string("nothing was changed: job store: ") + e.what()};
  } catch (const std::exception& e) {
    spdlog::error("{}", e.what());
    return {grpc::StatusCode::INTERNAL, e.what()};
  }
}

/// Answers on the serial thread. Request and response live until Finish.
template <typename Run>
grpc::ServerUnaryReactor* Answer(JobsApp& app, grpc::CallbackServerContext* context, Run run) {
  auto* reactor = context->DefaultReactor();
  const bool taken = app.thread().TryPost([reactor, context, run] {
    if (context->IsCancelled()) {
      reactor->Finish(grpc::Status::CANCELLED);
      return;
    }
    reactor->Finish(StatusOf(run));
  });
  if (!taken) reactor->Finish(kBusy);
  return reactor;
}

std::string WithPort(const std::string& address, int port) {
  if (address.starts_with("unix:")) return address;
  return address.substr(0, address.rfind(':') + 1) + std::to_string(port);
}

}  // namespace

grpc::ServerUnaryReactor* JobsServiceAdapter::SubmitRefinement(
    grpc::CallbackServerContext* context, const v1alpha1::SubmitRefinementRequest* request,
    v1alpha1::SubmitRefinementResponse* response) {
  return Answer(app_, context, [this, request, response] { *response = app_.Submit(*request); });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::GetJob(grpc::CallbackServerContext* context,
                                                     const v1alpha1::GetJobRequest* request,
                                                     v1alpha1::GetJobResponse* response) {
  return Answer(app_, context, [this, request, response] { *response = app_.Get(*request); });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::ListJobs(grpc::CallbackServerContext* context,
                                                       const v1alpha1::ListJobsRequest* request,
                                                       v1alpha1::ListJobsResponse* response) {
  return Answer(app_, context, [this, request, response] { *response = app_.List(*request); });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::CancelJob(grpc::CallbackServerContext* context,
                                                        const v1alpha1::CancelJobRequest* request,
                                                        v1alpha1::CancelJobResponse* response) {
  return Answer(app_, context, [this, request, response] { *response = app_.Cancel(*request); });
}

grpc::ServerUnaryReactor* JobsServiceAdapter::Promote(grpc::CallbackServerContext* context,
                                                      const v1alpha1::PromoteRequest* request,
                                                      v1alpha1::PromoteResponse* response) {
  return Answer(app_, context, [this, request, response, peer = context->peer()] {
    *response = app_.Promote(*request, peer);
  });
}

grpc::ServerWriteReactor<v1alpha1::WatchJobResponse>* JobsServiceAdapter::WatchJob(
    grpc::CallbackServerContext*, const v1alpha1::WatchJobRequest* request) {
  const auto reactor = WatchReactor::Create();
  // A copy: the stream may be cancelled, and the request gone, before its turn.
  const bool taken = app_.thread().TryPost([this, reactor, request = *request] {
    const grpc::Status status = StatusOf([&] { app_.Watch(request, reactor); });
    if (!status.ok()) reactor->End(status);
  });
  if (!taken) reactor->End(kBusy);
  return reactor.get();
}

JobsServer::JobsServer(JobsApp& app, const std::string& address) : adapter_(app) {
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  grpc::ServerBuilder builder;
  // Without this a second program would share the port and take half the calls.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.SetMaxReceiveMessageSize(kMaxReceiveBytes);
  int port = 0;
  builder.AddListeningPort(address, grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&adapter_);
  server_ = builder.BuildAndStart();
  if (server_ == nullptr || port == 0) {
    throw std::runtime_error("grpc address " + address +
                             ": cannot listen there (port in use, or no such address)");
  }
  address_ = WithPort(address, port);
  server_->GetHealthCheckService()->SetServingStatus(true);
}

JobsServer::~JobsServer() { Shutdown(0); }

void JobsServer::Shutdown(double drain_s) {
  if (server_ == nullptr) return;
  server_->GetHealthCheckService()->Shutdown();
  server_->Shutdown(std::chrono::system_clock::now() +
                    std::chrono::duration_cast<std::chrono::system_clock::duration>(
                        std::chrono::duration<double>(drain_s)));
  server_->Wait();
  server_.reset();
}

}  // namespace grouser::server
