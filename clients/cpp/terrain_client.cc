#include "clients/cpp/terrain_client.h"

#include <algorithm>
#include <utility>

#include "clients/cpp/client_error.h"

namespace grouser::client {
namespace {

using TerrainStub = v1alpha1::TerrainService::Stub;

}  // namespace

WheelStreamSession::WheelStreamSession(Milliseconds receive_limit)
    : receive_limit_(receive_limit), watch_([this](const std::stop_token& stop) { Watch(stop); }) {}

void WheelStreamSession::Watch(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    const auto now = Clock::now();
    const auto due = due_.load();
    if (due <= now) {
      late_ = true;
      context_->TryCancel();
      return;
    }
    wake_.wait_until(lock, stop, std::min(due, now + receive_limit_), [] { return false; });
  }
}

bool WheelStreamSession::Read(v1alpha1::EvaluateWheelsResponse* response) {
  due_ = Clock::now() + receive_limit_;
  const bool ok = stream_->Read(response);
  due_ = Clock::time_point::max();
  return ok;
}

bool WheelStreamSession::Send(const v1alpha1::EvaluateWheelsRequest& request) {
  return stream_->Write(request);
}

bool WheelStreamSession::Receive(v1alpha1::EvaluateWheelsResponse* response) {
  return Read(response);
}

void WheelStreamSession::Finish() {
  if (finished_) return;
  finished_ = true;
  stream_->WritesDone();
  v1alpha1::EvaluateWheelsResponse dropped;
  while (Read(&dropped)) {
  }
  const grpc::Status status = stream_->Finish();
  if (late_) {
    throw ClientError(grpc::StatusCode::DEADLINE_EXCEEDED,
                      "no answer within " + std::to_string(receive_limit_.count()) +
                          " ms on the stream (server " + server_.address + ")");
  }
  ThrowUnlessOk(status, server_, context_.get());
}

WheelStreamSession::~WheelStreamSession() {
  if (finished_ || !stream_) return;
  context_->TryCancel();
  stream_->Finish();
}

TerrainClient::TerrainClient(Server server, Milliseconds deadline)
    : server_(std::move(server)),
      deadline_(deadline),
      stub_(v1alpha1::TerrainService::NewStub(MakeChannel(server_))) {}

v1alpha1::EvaluateWheelsResponse TerrainClient::Evaluate(
    const v1alpha1::EvaluateWheelsRequest& request) const {
  v1alpha1::EvaluateWheelsResponse response;
  Evaluate(request, &response);
  return response;
}

void TerrainClient::Evaluate(const v1alpha1::EvaluateWheelsRequest& request,
                             v1alpha1::EvaluateWheelsResponse* response) const {
  grpc::ClientContext context;
  context.set_deadline(DeadlineAfter(deadline_));
  ThrowUnlessOk(stub_->EvaluateWheels(&context, request, response), server_, &context);
}

v1alpha1::ListModelsResponse TerrainClient::ListModels() const {
  v1alpha1::ListModelsResponse all;
  v1alpha1::ListModelsRequest request;
  do {
    const auto page = Call(*stub_, &TerrainStub::ListModels, request, server_, deadline_);
    request.set_page_token(page.next_page_token());
    all.MergeFrom(page);
  } while (!request.page_token().empty());
  all.clear_next_page_token();
  return all;
}

v1alpha1::GetModelResponse TerrainClient::GetModel(const std::string& model) const {
  v1alpha1::GetModelRequest request;
  request.set_model(model);
  return Call(*stub_, &TerrainStub::GetModel, request, server_, deadline_);
}

v1alpha1::ExplainResponse TerrainClient::Explain(const v1alpha1::ExplainRequest& request) const {
  return Call(*stub_, &TerrainStub::Explain, request, server_, deadline_);
}

std::unique_ptr<WheelStreamSession> TerrainClient::OpenStream() const {
  std::unique_ptr<WheelStreamSession> session(new WheelStreamSession(deadline_));
  session->server_ = server_;
  session->stream_ = stub_->StreamWheels(session->context_.get());
  return session;
}

}  // namespace grouser::client
