#pragma once

#include <google/protobuf/message_lite.h>
#include <grpcpp/server_context.h>

#include <atomic>
#include <boost/intrusive/list.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <unordered_map>
#include <utility>

#include "google/rpc/status.pb.h"
#include "server/net/backlog.h"

namespace grouser::server {

/// Counts the bytes of requests and answers that are under way, over all connections and by
/// connection, refuses what would pass a limit, and cancels calls whose clients do not take their
/// answers. Thread-safe; outlives the calls.
class LoadControl {
 public:
  using Clock = std::chrono::steady_clock;
  using Milliseconds = std::chrono::milliseconds;

  struct Limits {
    /// Over all connections. Each may hold as much as is free: one alone half of it, and n that
    /// hold what they can leave one part in n + 1 to others. All clients of a Unix socket count as
    /// one connection: gRPC has one name for them. Small requests may take an eighth
    /// more, and one message is taken whatever its size where there is no other.
    std::size_t bytes = SIZE_MAX;
    /// An answer that its client does not take within it is cancelled; a tenth of it while more
    /// than half of the memory is taken.
    Clock::duration answer = Clock::duration::max();
  };

  /// What a refused client should wait before it tries again.
  static constexpr Milliseconds kRetryAfter{50};

  struct Connection;
  /// One message from when it is seen until gRPC is done with its answer. Its owner outlives the
  /// time between Begin() and End().
  class Ticket : public boost::intrusive::list_base_hook<> {
   public:
    bool counted() const { return connection_ != nullptr; }

   private:
    friend class LoadControl;
    grpc::CallbackServerContext* context_ = nullptr;
    std::pair<const std::string, Connection>* connection_ = nullptr;
    std::size_t bytes_ = 0, expected_ = 0;  // the former with the latter
    Clock::time_point answered_;
  };

  struct Connection {
    std::size_t bytes = 0;
    std::size_t tickets = 0;
  };

  enum class Verdict { kAdmitted, kNoMemory, kConnectionFull, kBusy };

  void SetLimits(const Limits& limits);

  /// Counts a message of so many bytes. Unless admitted nothing is counted.
  Verdict Begin(Ticket& ticket, grpc::CallbackServerContext& context, std::size_t bytes);
  /// The same for memory that no message is in, such as what a stream keeps for the next one.
  Verdict Hold(Ticket& ticket, grpc::CallbackServerContext& context, std::size_t bytes);
  /// An admitted message's answer will take about so much (AnswerBytes): counted until Answer(),
  /// which counts what there is instead. Unless admitted nothing is added, and the message ends
  /// without an answer.
  Verdict Expect(Ticket& ticket, std::size_t bytes);
  /// The answer goes to gRPC: so many more bytes are held until End(), which `answer` limits. Never
  /// refused: an answer that is there is sent.
  void Answer(Ticket& ticket, std::size_t bytes);
  /// Idempotent; nothing for what was not admitted.
  void End(Ticket& ticket);

  /// `drop` frees memory that is kept for reuse; called when nothing has come for a while. Before
  /// the first call.
  void OnIdle(std::function<void()> drop) { drop_ = std::move(drop); }
  void DropSpare() {
    if (drop_) drop_();
  }

  /// More than half of the memory is taken: none should be kept for reuse.
  bool Tight() const { return bytes_ > tight_bytes_; }

  /// Tells how long requests wait.
  Backlog& backlog() { return backlog_; }

  /// Cancels calls that wait for their clients too long. On a timer.
  void CancelStuck(Clock::time_point now);

  std::size_t bytes() const { return bytes_; }          ///< now
  std::uint64_t messages() const { return messages_; }  ///< that began, refused ones too
  std::uint64_t refused() const { return refused_; }
  std::uint64_t cancelled() const { return cancelled_; }  ///< whose clients took no answer

 private:
  void Add(Ticket& ticket, std::size_t bytes);
  void DropExpected(Ticket& ticket);

  std::mutex mutex_;
  Limits limits_;
  std::atomic<std::size_t> tight_bytes_{SIZE_MAX};
  std::function<void()> drop_;
  Backlog backlog_;
  std::unordered_map<std::string, Connection> connections_;
  boost::intrusive::list<Ticket> answers_;  // with gRPC, the oldest first
  std::atomic<std::size_t> bytes_{0};
  std::atomic<std::uint64_t> messages_{0}, refused_{0}, cancelled_{0};
};

/// What an answer holds until gRPC is done with it: itself, and its bytes as they are sent.
inline constexpr std::size_t kHeldPerAnswerByte = 2;
std::size_t AnswerBytes(const google::protobuf::MessageLite& answer);

/// The status of what was not admitted, and the hint for unary calls and the ends of streams:
/// trailing metadata "grpc-retry-pushback-ms"; in band on streams: google.rpc.RetryInfo.
grpc::Status RefusalStatus(LoadControl::Verdict verdict);
void HintRetry(grpc::CallbackServerContext& context);
void RefuseInBand(LoadControl::Verdict verdict, google::rpc::Status* error);

}  // namespace grouser::server
