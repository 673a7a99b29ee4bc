#pragma once

#include <google/protobuf/message_lite.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <string_view>
#include <unordered_set>

#include "server/net/call_records.h"
#include "server/net/load_control.h"

namespace grouser::server {

/// A stream that can end before its client ends it.
class DrainableStream {
 public:
  virtual ~DrainableStream() = default;
  /// Nothing more is read; the stream ends with UNAVAILABLE after the answer under
  /// way, or when what it waits for ends. Any thread.
  virtual void BeginDrain() = 0;
};

/// Counts the messages under way and the open streams of a service, so that a
/// drain knows when all that was sent before it has been answered. Thread-safe;
/// outlives the calls.
class CallGate {
 public:
  using Milliseconds = std::chrono::milliseconds;

  /// One message begins. False: answer UNAVAILABLE. Leave() either way.
  bool Enter();
  void Leave() { --under_way_; }

  /// False when refusing: the stream should end at once. Remove it either way.
  bool Add(DrainableStream* stream);
  void Remove(DrainableStream* stream);

  /// Waits until no message has been under way for `quiet`, at most `limit`.
  /// Messages may still be in the kernel's and gRPC's buffers, which nobody can
  /// look into; only time tells that none is left there.
  bool WaitQuiet(Milliseconds quiet, Milliseconds limit) const;
  /// Refuses new messages from now on and tells every stream. Idempotent.
  void Refuse();
  /// Waits until no message is under way and no stream open, at most `limit`.
  bool WaitEmpty(Milliseconds limit) const;

  /// The memory of what is under way.
  LoadControl& load() { return load_; }
  /// What became of the calls.
  CallRecords& records() { return records_; }
  void AddTo(MetricPage* page) const;

 private:
  LoadControl load_;
  std::atomic<int> under_way_{0};
  std::atomic<unsigned> entered_{0};
  std::atomic<bool> refusing_{false};
  mutable std::mutex mutex_;
  std::unordered_set<DrainableStream*> streams_;
  CallRecords records_;
};

/// Status of what comes during a drain.
grpc::Status ShuttingDown();
/// As the records count it.
Refusal ReasonOf(LoadControl::Verdict verdict);
/// Status of what is not begun, as nobody waits for it any more.
grpc::Status TooLate();

/// One unary call that a gate counts, with its bytes, until gRPC is done with it. Deletes itself
/// then.
class UnaryCall : public grpc::ServerUnaryReactor {
 public:
  /// Finishes the call at once during a drain, where its client is gone or its deadline has passed
  /// in the queue, and where `request` does not fit in the memory for what is under way.
  /// `method`: its name in CallRecords.
  UnaryCall(CallGate& gate, grpc::CallbackServerContext& context, std::string_view method,
            const google::protobuf::MessageLite& request);
  /// False: the call has been finished, do nothing but return it.
  bool admitted() const { return admitted_; }
  /// Counts an answer of so many bytes before it is made. Not ok: what to finish the call with.
  grpc::Status Expect(std::size_t answer_bytes);
  /// Ends an admitted call with an answer.
  void FinishWith(const grpc::Status& status, const google::protobuf::MessageLite& response);
  /// Ends the call without an answer, once, and records it.
  void Finish(const grpc::Status& status);
  void OnDone() final;

 private:
  grpc::Status Refused(LoadControl::Verdict verdict);
  grpc::Status Admit(const google::protobuf::MessageLite& request);

  CallGate& gate_;
  LoadControl::Ticket ticket_;
  grpc::CallbackServerContext& context_;
  CallRecords::Method& method_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  bool admitted_ = false;
};

/// Finishes a new UnaryCall with the status that `answer` returns, after it has filled `response`.
template <class Answer>
grpc::ServerUnaryReactor* AnswerNow(CallGate& gate, grpc::CallbackServerContext& context,
                                    std::string_view method,
                                    const google::protobuf::MessageLite& request,
                                    const google::protobuf::MessageLite& response,
                                    const Answer& answer) {
  auto* call = new UnaryCall(gate, context, method, request);
  if (call->admitted()) call->FinishWith(answer(), response);
  return call;
}

}  // namespace grouser::server
