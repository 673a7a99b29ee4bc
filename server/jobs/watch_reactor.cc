#include "server/jobs/watch_reactor.h"

#include "server/jobs/job_state.h"

namespace grouser::server {

std::shared_ptr<WatchReactor> WatchReactor::Create(CallGate& gate,
                                                   grpc::CallbackServerContext& context) {
  auto reactor = std::make_shared<WatchReactor>(gate, context);
  reactor->self_ = reactor;
  if (!gate.Add(reactor.get())) reactor->OnStop();
  return reactor;
}

void WatchReactor::OnJob(const v1alpha1::Job& job) {
  {
    const std::lock_guard lock(mutex_);
    if (end_) return;
    const bool same_state = !waiting_.empty() && waiting_.back().job_state() == job.job_state();
    if (same_state) waiting_.pop_back();
    waiting_.push_back(job);
    if (HasEnded(job.job_state())) end_ = grpc::Status::OK;
  }
  Pump();
}

void WatchReactor::End(const grpc::Status& status) {
  {
    const std::lock_guard lock(mutex_);
    if (!end_) end_ = status;
  }
  Pump();
}

void WatchReactor::Pump() {
  enum class Next { kNothing, kWrite, kFinish } next = Next::kNothing;
  grpc::Status status;
  {
    const std::lock_guard lock(mutex_);
    if (writing_ || finished_) return;
    if (!waiting_.empty()) {
      *current_.mutable_job() = std::move(waiting_.front());
      waiting_.pop_front();
      writing_ = true;
      next = Next::kWrite;
    } else if (end_) {
      finished_ = true;
      status = *end_;
      next = Next::kFinish;
    }
  }
  if (next == Next::kWrite) {
    gate_.load().Hold(ticket_, context_, 0);  // a change is never refused
    gate_.load().Answer(ticket_, AnswerBytes(current_));
    StartWrite(&current_);
  }
  if (next == Next::kFinish) Finish(status);
}

void WatchReactor::OnWriteDone(bool ok) {
  gate_.load().End(ticket_);
  {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    if (!ok) {  // the reader is gone
      waiting_.clear();
      end_ = grpc::Status::CANCELLED;
    }
  }
  Pump();
}

void WatchReactor::OnCancel() {
  {
    const std::lock_guard lock(mutex_);
    waiting_.clear();
    end_ = grpc::Status::CANCELLED;
  }
  Pump();
}

void WatchReactor::OnDone() {
  gate_.load().End(ticket_);
  gate_.Remove(this);
  const auto last = std::move(self_);
}

}  // namespace grouser::server
