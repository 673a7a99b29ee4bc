#pragma once

#include <grpcpp/support/server_callback.h>

#include <mutex>
#include <unordered_set>

#include "grouser/v1alpha1/terrain_service.pb.h"
#include "server/core/snapshot_store.h"

namespace grouser::server {

class WheelStream;

/// The open streams, so that a drain can end them. Must outlive them.
class StreamRegistry {
 public:
  /// False when draining: the stream should end at once.
  bool Add(WheelStream* stream);
  void Remove(WheelStream* stream);
  /// Ends every stream with UNAVAILABLE after the answer under way.
  void Drain();

 private:
  std::mutex mutex_;
  std::unordered_set<WheelStream*> streams_;
  bool draining_ = false;
};

/// One StreamWheels call. A bad message is answered in band and does not end
/// the stream. Bounded: one request is read ahead while one answer is written,
/// so a client that does not read holds two answers, no more. Deletes itself.
class WheelStream final
    : public grpc::ServerBidiReactor<v1alpha1::EvaluateWheelsRequest,
                                     v1alpha1::EvaluateWheelsResponse> {
 public:
  WheelStream(const SnapshotStore& store, StreamRegistry& registry);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone() override;
  /// Any thread.
  void BeginDrain();

 private:
  void WriteNext();  // needs mutex_
  void FinishOnce(const QueryStatus& status);  // needs mutex_

  const SnapshotStore& store_;
  StreamRegistry& registry_;
  v1alpha1::EvaluateWheelsRequest request_;  // owned by the reading side
  v1alpha1::EvaluateWheelsResponse responses_[2];

  std::mutex mutex_;  // reactions may run at the same time
  int next_ = 0;            // response that the next answer goes to
  bool answering_ = false;  // responses_[next_] is being filled
  bool answered_ = false;   // responses_[next_] waits to be written
  bool writing_ = false;    // responses_[1 - next_] is being written
  bool reads_done_ = false;
  bool draining_ = false;
  bool finished_ = false;
};

}  // namespace grouser::server
