#include "server/query/grpc/wheel_stream.h"

#include <utility>

namespace grouser::server {
namespace {

// The memory of a bigger request counts as taken while the stream keeps it for the next one.
constexpr std::size_t kBigBytes = 64 * 1024;

}  // namespace

WheelStream::WheelStream(const QueryPath& path, CallGate& gate,
                         grpc::CallbackServerContext& context, WheelMessages& pool)
    : path_(path), gate_(gate), context_(context), pool_(pool) {
  const bool admitted = gate_.Add(this);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!admitted) draining_ = true;
  if (draining_) {
    reads_done_ = true;
    WriteNext();
  } else {
    StartRead(&request_);
  }
}

WheelStream::~WheelStream() {
  gate_.load().End(kept_);
  for (Slot& slot : slots_) Free(slot);
}

void WheelStream::Free(Slot& slot) {
  gate_.load().End(slot.ticket);
  if (auto* messages = std::exchange(slot.messages, nullptr)) messages->Release();
}

void WheelStream::AnswerInto(Slot& slot) {
  LoadControl& load = gate_.load();
  slot.messages = pool_.AllocateMessages();
  v1alpha1::EvaluateWheelsResponse& response = *slot.messages->response();
  const std::size_t bytes = request_.ByteSizeLong();
  const auto verdict = load.Begin(slot.ticket, context_, bytes);
  if (verdict == LoadControl::Verdict::kAdmitted) {
    Answer(path_, Transport::kStream, request_, &response);
    load.Answer(slot.ticket, AnswerBytes(response));
  } else {
    response.Clear();
    response.set_sequence(request_.sequence());
    gate_.records().Refused(ReasonOf(verdict));
    RefuseInBand(verdict, response.mutable_error());
  }
  KeepOrDropRequest(bytes);
}

void WheelStream::KeepOrDropRequest(std::size_t bytes) {
  LoadControl& load = gate_.load();
  load.End(kept_);
  if (bytes < kBigBytes) return;
  const bool keep =
      !load.Tight() && load.Hold(kept_, context_, bytes) == LoadControl::Verdict::kAdmitted;
  if (!keep) request_ = {};
}

void WheelStream::OnReadDone(bool ok) {
  if (ok) {
    const std::lock_guard<std::mutex> lock(mutex_);
    answering_ = gate_.Enter() && !finished_ && !context_.IsCancelled();
    if (!answering_) gate_.Leave();  // a drain ends the stream, or nobody waits for it any more
    ok = answering_;
  }
  if (ok) {
    // No lock: slots_[next_] and request_ belong to the reading side until
    // answered_ is set, and no second read is under way.
    AnswerInto(slots_[next_]);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  answering_ = false;
  if (ok) {
    answered_ = true;
  } else {
    reads_done_ = true;
  }
  if (!writing_) WriteNext();
}

void WheelStream::OnWriteDone(bool ok) {
  const std::lock_guard<std::mutex> lock(mutex_);
  writing_ = false;
  Free(slots_[1 - next_]);
  gate_.Leave();
  if (!ok) {
    // The call is dead; a read under way comes back with ok = false.
    reads_done_ = true;
    if (std::exchange(answered_, false)) gate_.Leave();
  }
  WriteNext();
}

void WheelStream::WriteNext() {
  if (finished_ || answering_) return;  // the reading side comes back here
  if (answered_) {
    answered_ = false;
    writing_ = true;
    StartWrite(slots_[next_].messages->response());
    next_ = 1 - next_;
    if (!draining_ && !reads_done_) StartRead(&request_);
    return;
  }
  if (draining_) {
    FinishOnce(ShuttingDown());
  } else if (reads_done_) {
    FinishOnce(grpc::Status::OK);
  }
}

void WheelStream::FinishOnce(const grpc::Status& status) {
  if (finished_) return;
  finished_ = true;
  Finish(status);
}

void WheelStream::BeginDrain() {
  const std::lock_guard<std::mutex> lock(mutex_);
  draining_ = true;
  // Otherwise the completion of the write under way goes on from here.
  if (!writing_) WriteNext();
}

void WheelStream::OnDone() {
  gate_.Remove(this);
  delete this;
}

}  // namespace grouser::server
