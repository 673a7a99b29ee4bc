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

grpc::Status ShuttingDown() {
  return {grpc::StatusCode::UNAVAILABLE, "the server is shutting down"};
}

UnaryCall::UnaryCall(CallGate& gate, const grpc::CallbackServerContext& context)
    : gate_(gate), admitted_(gate.Enter()) {
  if (!admitted_) {
    Finish(ShuttingDown());
  } else if (context.IsCancelled()) {
    admitted_ = false;
    Finish(grpc::Status::CANCELLED);
  }
}

void UnaryCall::OnDone() {
  gate_.Leave();
  delete this;
}

}  // namespace grouser::server
