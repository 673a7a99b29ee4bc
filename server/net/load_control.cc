#include "server/net/load_control.h"

#include <algorithm>
#include <utility>

#include "google/rpc/error_details.pb.h"

namespace grouser::server {
namespace {

// While memory is short a client has one part in so many of the time to take its answer.
constexpr int kTightShare = 10;
// Smaller requests are not refused for the time that they would wait: to read and refuse one takes
// about as long as to answer it.
constexpr std::size_t kCostlyBytes = 16 * 1024;
// One part in so many of the memory is left to small requests when big ones have taken the rest.
constexpr std::size_t kReserve = 8;
// What the answer to a big request takes, over the request: 10,000 states in slip form, all parts
// of the uncertainty, the message and its bytes.
constexpr std::size_t kAnswerPerRequest = 40;

}  // namespace

void LoadControl::SetLimits(const Limits& limits) {
  const std::lock_guard lock(mutex_);
  limits_ = limits;
  tight_bytes_ = limits.bytes / 2;
}

LoadControl::Verdict LoadControl::Begin(Ticket& ticket, grpc::CallbackServerContext& context,
                                        std::size_t bytes) {
  ++messages_;
  const bool busy = bytes >= kCostlyBytes && backlog_.TooLong(Clock::now());
  const Verdict verdict = busy ? Verdict::kBusy : Hold(ticket, context, bytes);
  if (verdict == Verdict::kAdmitted) return verdict;
  ++refused_;
  backlog_.Done();
  return verdict;
}

LoadControl::Verdict LoadControl::Hold(Ticket& ticket, grpc::CallbackServerContext& context,
                                       std::size_t bytes) {
  std::string peer = context.peer();
  const std::lock_guard lock(mutex_);
  const bool costly = bytes >= kCostlyBytes;
  const std::size_t expected = costly ? kAnswerPerRequest * bytes : bytes;
  const std::size_t most = limits_.bytes + (costly ? 0 : limits_.bytes / kReserve);
  const std::size_t room = most - std::min<std::size_t>(most, bytes_);
  if (expected > room && bytes_ > 0) return Verdict::kNoMemory;
  const auto [it, added] = connections_.try_emplace(std::move(peer));
  Connection& connection = it->second;
  if (expected > 0 && connection.bytes > 0 && connection.bytes + expected > room) {
    if (added) connections_.erase(it);
    return Verdict::kConnectionFull;
  }
  connection.bytes += bytes;
  ++connection.tickets;
  bytes_ += bytes;
  ticket.context_ = &context;
  ticket.connection_ = &*it;
  ticket.bytes_ = bytes;
  ticket.expected_ = 0;
  return Verdict::kAdmitted;
}

// Under the lock.
void LoadControl::Add(Ticket& ticket, std::size_t bytes) {
  ticket.bytes_ += bytes;
  ticket.connection_->second.bytes += bytes;
  bytes_ += bytes;
}
void LoadControl::DropExpected(Ticket& ticket) {
  ticket.bytes_ -= ticket.expected_;
  ticket.connection_->second.bytes -= ticket.expected_;
  bytes_ -= ticket.expected_;
  ticket.expected_ = 0;
}

LoadControl::Verdict LoadControl::Expect(Ticket& ticket, std::size_t bytes) {
  if (!ticket.counted() || bytes == 0) return Verdict::kAdmitted;
  const std::lock_guard lock(mutex_);
  const std::size_t most = limits_.bytes + (bytes >= kCostlyBytes ? 0 : limits_.bytes / kReserve);
  const std::size_t room = most - std::min<std::size_t>(most, bytes_);
  const std::size_t connection = ticket.connection_->second.bytes;
  Verdict verdict = Verdict::kAdmitted;
  if (bytes > room && bytes_ > ticket.bytes_) {
    verdict = Verdict::kNoMemory;
  } else if (connection > ticket.bytes_ && connection + bytes > room) {
    verdict = Verdict::kConnectionFull;
  }
  if (verdict != Verdict::kAdmitted) {
    ++refused_;
    backlog_.Done();
    return verdict;
  }
  Add(ticket, bytes);
  ticket.expected_ += bytes;
  return verdict;
}

void LoadControl::Answer(Ticket& ticket, std::size_t bytes) {
  if (!ticket.counted()) return;
  backlog_.Done();
  const std::lock_guard lock(mutex_);
  DropExpected(ticket);
  Add(ticket, bytes);
  ticket.answered_ = Clock::now();
  if (!ticket.is_linked()) answers_.push_back(ticket);
}

void LoadControl::End(Ticket& ticket) {
  if (!ticket.counted()) return;
  const std::lock_guard lock(mutex_);
  if (ticket.is_linked()) answers_.erase(answers_.iterator_to(ticket));
  bytes_ -= ticket.bytes_;
  Connection& connection = ticket.connection_->second;
  connection.bytes -= ticket.bytes_;
  if (--connection.tickets == 0) connections_.erase(connections_.find(ticket.connection_->first));
  ticket.connection_ = nullptr;
}

void LoadControl::CancelStuck(Clock::time_point now) {
  // Held throughout: a call ends its ticket under this lock before its context goes. gRPC runs no
  // reaction of the call within TryCancel().
  const std::lock_guard lock(mutex_);
  const auto limit = Tight() ? limits_.answer / kTightShare : limits_.answer;
  for (auto it = answers_.begin(); it != answers_.end();) {
    if (now - it->answered_ < limit) return;
    it->context_->TryCancel();
    ++cancelled_;
    it = answers_.erase(it);
  }
}

std::size_t AnswerBytes(const google::protobuf::MessageLite& answer) {
  return kHeldPerAnswerByte * answer.ByteSizeLong();
}

grpc::Status RefusalStatus(LoadControl::Verdict verdict) {
  using Verdict = LoadControl::Verdict;
  const char* why = verdict == Verdict::kBusy ? "more is asked than this server can answer"
                    : verdict == Verdict::kConnectionFull
                        ? "answers that this connection has not taken yet hold all memory it may"
                        : "answers that are not taken yet hold all memory for them";
  return {grpc::StatusCode::RESOURCE_EXHAUSTED,
          std::string("overload: ") + why + "; try again in " +
              std::to_string(LoadControl::kRetryAfter.count()) + " ms"};
}

void HintRetry(grpc::CallbackServerContext& context) {
  context.AddTrailingMetadata("grpc-retry-pushback-ms",
                              std::to_string(LoadControl::kRetryAfter.count()));
}

void RefuseInBand(LoadControl::Verdict verdict, google::rpc::Status* error) {
  const grpc::Status status = RefusalStatus(verdict);
  error->set_code(status.error_code());
  error->set_message(status.error_message());
  google::rpc::RetryInfo retry;
  retry.mutable_retry_delay()->set_nanos(
      static_cast<int>(std::chrono::nanoseconds(LoadControl::kRetryAfter).count()));
  error->add_details()->PackFrom(retry);
}

}  // namespace grouser::server
