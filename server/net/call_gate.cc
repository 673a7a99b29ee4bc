#include "server/net/call_gate.h"

#include <algorithm>
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

void CallGate::AddTo(MetricPage* page) const {
  page->AddGauge("grouser_calls_under_way", "Messages that came and were not answered yet.",
                 static_cast<double>(std::max(0, under_way_.load())));
  std::size_t streams = 0;
  {
    const std::lock_guard lock(mutex_);
    streams = streams_.size();
  }
  page->AddGauge("grouser_streams", "Open streams.", static_cast<double>(streams));
  page->AddGauge("grouser_memory_under_way_bytes", "Requests and answers that are under way.",
                 static_cast<double>(load_.bytes()));
  page->AddCounter("grouser_answers_not_taken_total",
                   "Calls that were cancelled since their client did not take the answer in time.",
                   static_cast<double>(load_.cancelled()));
  records_.AddTo(page);
}

Refusal ReasonOf(LoadControl::Verdict verdict) {
  switch (verdict) {
    case LoadControl::Verdict::kConnectionFull:
      return Refusal::kConnectionFull;
    case LoadControl::Verdict::kBusy:
      return Refusal::kBusy;
    default:
      return Refusal::kNoMemory;
  }
}

UnaryCall::UnaryCall(CallGate& gate, grpc::CallbackServerContext& context, std::string_view method,
                     const google::protobuf::MessageLite& request)
    : gate_(gate), context_(context), method_(gate.records().Of(method)) {
  const grpc::Status status = Admit(request);
  admitted_ = status.ok();
  if (!admitted_) Finish(status);
}

grpc::Status UnaryCall::Admit(const google::protobuf::MessageLite& request) {
  const auto refuse = [this](Refusal reason, grpc::Status status) {
    gate_.records().Refused(reason);
    return status;
  };
  if (!gate_.Enter()) return refuse(Refusal::kDraining, ShuttingDown());
  if (context_.IsCancelled()) return refuse(Refusal::kCancelled, grpc::Status::CANCELLED);
  if (context_.deadline() < std::chrono::system_clock::now()) {
    return refuse(Refusal::kTooLate, TooLate());
  }
  const auto verdict = gate_.load().Begin(ticket_, context_, request.ByteSizeLong());
  return verdict == LoadControl::Verdict::kAdmitted ? grpc::Status::OK : Refused(verdict);
}

grpc::Status UnaryCall::Refused(LoadControl::Verdict verdict) {
  gate_.records().Refused(ReasonOf(verdict));
  HintRetry(context_);
  return RefusalStatus(verdict);
}

grpc::Status UnaryCall::Expect(std::size_t answer_bytes) {
  const auto verdict = gate_.load().Expect(ticket_, kHeldPerAnswerByte * answer_bytes);
  return verdict == LoadControl::Verdict::kAdmitted ? grpc::Status::OK : Refused(verdict);
}

void UnaryCall::FinishWith(const grpc::Status& status,
                           const google::protobuf::MessageLite& response) {
  gate_.load().Answer(ticket_, status.ok() ? AnswerBytes(response) : 0);
  Finish(status);
}

void UnaryCall::Finish(const grpc::Status& status) {
  gate_.records().Ended(method_, context_, status, std::chrono::steady_clock::now() - start_);
  ServerUnaryReactor::Finish(status);
}

void UnaryCall::OnDone() {
  gate_.load().End(ticket_);
  gate_.Leave();
  delete this;
}

}  // namespace grouser::server
