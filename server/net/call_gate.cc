#include "server/net/call_gate.h"

#include <thread>

namespace grouser::server {
namespace {

constexpr CallGate::Milliseconds kStep(5);
using Clock = std::chrono::steady_clock;

}  // namespace

bool CallGate::Enter() {
  ++under_way_;
  ++entered_;
  return !refusing_;
}

bool CallGate::Add(DrainableStream* stream) {
  const std::lock_guard lock(mutex_);
  streams_.insert(stream);
  return !refusing_;
}

void CallGate::Remove(DrainableStream* stream) {
  const std::lock_guard lock(mutex_);
  streams_.erase(stream);
}

bool CallGate::WaitQuiet(Milliseconds quiet, Milliseconds limit) const {
  const auto end = Clock::now() + limit;
  auto quiet_since = Clock::now();
  for (unsigned seen = entered_; Clock::now() < end;) {
    std::this_thread::sleep_for(kStep);
    if (under_way_ != 0 || entered_ != seen) {
      seen = entered_;
      quiet_since = Clock::now();
    } else if (Clock::now() - quiet_since >= quiet) {
      return true;
    }
  }
  return false;
}

void CallGate::Refuse() {
  // Held throughout: a stream removes itself under this lock before it is
  // deleted.
  const std::lock_guard lock(mutex_);
  refusing_ = true;
  for (DrainableStream* stream : streams_) stream->BeginDrain();
}

bool CallGate::WaitEmpty(Milliseconds limit) const {
  const auto end = Clock::now() + limit;
  const auto empty = [this] {
    const std::lock_guard lock(mutex_);
    return under_way_ == 0 && streams_.empty();
  };
  while (!empty()) {
    if (Clock::now() > end) return false;
    std::this_thread::sleep_for(kStep);
  }
  return true;
}

grpc::Status TooLate() {
  return {grpc::StatusCode::DEADLINE_EXCEEDED, "the deadline passed before the call's turn"};
}

grpc::Status ShuttingDown() {
  return {grpc::StatusCode::UNAVAILABLE, "the server is shutting down"};
}

UnaryCall::UnaryCall(CallGate& gate, grpc::CallbackServerContext& context,
                     const google::protobuf::MessageLite& request)
    : gate_(gate) {
  const grpc::Status status = Admit(context, request);
  admitted_ = status.ok();
  if (!admitted_) Finish(status);
}

grpc::Status UnaryCall::Admit(grpc::CallbackServerContext& context,
                              const google::protobuf::MessageLite& request) {
  if (!gate_.Enter()) return ShuttingDown();
  if (context.IsCancelled()) return grpc::Status::CANCELLED;
  if (context.deadline() < std::chrono::system_clock::now()) return TooLate();
  const auto verdict = gate_.load().Begin(ticket_, context, request.ByteSizeLong());
  if (verdict == LoadControl::Verdict::kAdmitted) return grpc::Status::OK;
  HintRetry(context);
  return Refusal(verdict);
}

void UnaryCall::FinishWith(const grpc::Status& status,
                           const google::protobuf::MessageLite& response) {
  gate_.load().Answer(ticket_, status.ok() ? AnswerBytes(response) : 0);
  Finish(status);
}

void UnaryCall::OnDone() {
  gate_.load().End(ticket_);
  gate_.Leave();
  delete this;
}

}  // namespace grouser::server
