#include "server/query/grpc/wheel_stream.h"

#include <utility>

#include "server/query/grpc/answer.h"

namespace grouser::server {

WheelStream::WheelStream(const SnapshotStore& store, QueryMetrics& metrics, CallGate& gate)
    : store_(store), metrics_(metrics), gate_(gate) {
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

void WheelStream::OnReadDone(bool ok) {
  if (ok) {
    const std::lock_guard<std::mutex> lock(mutex_);
    answering_ = gate_.Enter() && !finished_;
    if (!answering_) gate_.Leave();  // a drain ends the stream
    ok = answering_;
  }
  if (ok) {
    // No lock: responses_[next_] and request_ belong to the reading side until
    // answered_ is set, and no second read is under way.
    Answer(store_, metrics_, Transport::kStream, request_, &responses_[next_]);
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
    StartWrite(&responses_[next_]);
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
