#include "server/query/grpc/wheel_stream.h"

#include "server/query/grpc/answer.h"
#include "server/query/grpc/grpc_status.h"

namespace grouser::server {

bool StreamRegistry::Add(WheelStream* stream) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (draining_) return false;
  streams_.insert(stream);
  return true;
}

void StreamRegistry::Remove(WheelStream* stream) {
  const std::lock_guard<std::mutex> lock(mutex_);
  streams_.erase(stream);
}

void StreamRegistry::Drain() {
  // Held throughout: OnDone removes its stream under this lock, so none of
  // them can be deleted meanwhile.
  const std::lock_guard<std::mutex> lock(mutex_);
  draining_ = true;
  for (WheelStream* stream : streams_) stream->BeginDrain();
}

WheelStream::WheelStream(const SnapshotStore& store, StreamRegistry& registry)
    : store_(store), registry_(registry) {
  const bool admitted = registry_.Add(this);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!admitted) draining_ = true;
  if (draining_) {
    reads_done_ = true;
    WriteNext();
  } else {
    StartRead(&request_);
  }
}

void WheelStream::OnReadDone(bool ok) {
  if (ok) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      answering_ = true;
    }
    // No lock: responses_[next_] and request_ belong to the reading side until
    // answered_ is set, and no second read is under way.
    Answer(store_, request_, &responses_[next_]);
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
  if (!ok) {
    // The call is dead; a read under way comes back with ok = false.
    reads_done_ = true;
    answered_ = false;
  }
  WriteNext();
}

void WheelStream::WriteNext() {
  if (finished_ || answering_) return;  // the reading side comes back here
  if (answered_) {
    answered_ = false;
    writing_ = true;
    StartWrite(&responses_[next_]);
    next_ = 1 - next_;
    if (!draining_ && !reads_done_) StartRead(&request_);
    return;
  }
  if (draining_) {
    FinishOnce({QueryCode::kUnavailable, "the server is shutting down"});
  } else if (reads_done_) {
    FinishOnce(QueryStatus::Ok());
  }
}

void WheelStream::FinishOnce(const QueryStatus& status) {
  if (finished_) return;
  finished_ = true;
  Finish(ToGrpcStatus(status));
}

void WheelStream::BeginDrain() {
  const std::lock_guard<std::mutex> lock(mutex_);
  draining_ = true;
  // Otherwise the completion of the write under way goes on from here.
  if (!writing_) WriteNext();
}

void WheelStream::OnDone() {
  registry_.Remove(this);
  delete this;
}

}  // namespace grouser::server
