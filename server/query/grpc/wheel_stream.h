#pragma once

#include <grpcpp/support/server_callback.h>

#include <memory>
#include <mutex>

#include "grouser/v1alpha1/terrain_service.pb.h"
#include "server/net/call_gate.h"
#include "server/query/grpc/answer.h"
#include "server/query/grpc/message_pool.h"

namespace grouser::server {

using WheelMessages =
    MessagePool<v1alpha1::EvaluateWheelsRequest, v1alpha1::EvaluateWheelsResponse>;

/// One StreamWheels call. A bad message, and one for which there is no memory, is answered in band
/// and does not end the stream. Bounded: one request is read ahead while one answer is written,
/// so a client that does not read holds two answers, no more, and an idle stream holds none.
/// Deletes itself. `path` and `pool` outlive it.
class WheelStream final : public grpc::ServerBidiReactor<v1alpha1::EvaluateWheelsRequest,
                                                         v1alpha1::EvaluateWheelsResponse>,
                          public DrainableStream {
 public:
  WheelStream(const QueryPath& path, CallGate& gate, grpc::CallbackServerContext& context,
              WheelMessages& pool);
  ~WheelStream() override;

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone() override;
  void BeginDrain() override;

 private:
  /// One answer, from when its request has come until gRPC has sent it.
  struct Slot {
    grpc::MessageHolder<v1alpha1::EvaluateWheelsRequest, v1alpha1::EvaluateWheelsResponse>*
        messages = nullptr;  // null: free
    LoadControl::Ticket ticket;
  };

  void AnswerInto(Slot& slot);
  void Free(Slot& slot);
  void KeepOrDropRequest(std::size_t bytes);
  void WriteNext();                             // needs mutex_
  void FinishOnce(const grpc::Status& status);  // needs mutex_

  const QueryPath& path_;
  CallGate& gate_;
  grpc::CallbackServerContext& context_;
  WheelMessages& pool_;
  v1alpha1::EvaluateWheelsRequest request_;  // owned by the reading side
  LoadControl::Ticket kept_;                 // the memory of a big request_, kept for the next
  Slot slots_[2];

  std::mutex mutex_;        // reactions may run at the same time
  int next_ = 0;            // slot that the next answer goes to
  bool answering_ = false;  // slots_[next_] is being filled
  bool answered_ = false;   // slots_[next_] waits to be written
  bool writing_ = false;    // slots_[1 - next_] is being written
  bool reads_done_ = false;
  bool draining_ = false;
  bool finished_ = false;
};

}  // namespace grouser::server
