#pragma once

#include <grpcpp/support/server_callback.h>

#include <mutex>

#include "grouser/v1alpha1/terrain_service.pb.h"
#include "server/core/query_metrics.h"
#include "server/core/snapshot_store.h"
#include "server/net/call_gate.h"

namespace grouser::server {

/// One StreamWheels call. A bad message is answered in band and does not end
/// the stream. Bounded: one request is read ahead while one answer is written,
/// so a client that does not read holds two answers, no more. Deletes itself.
class WheelStream final : public grpc::ServerBidiReactor<v1alpha1::EvaluateWheelsRequest,
                                                         v1alpha1::EvaluateWheelsResponse>,
                          public DrainableStream {
 public:
  WheelStream(const SnapshotStore& store, QueryMetrics& metrics, CallGate& gate);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone() override;
  void BeginDrain() override;

 private:
  void WriteNext();                             // needs mutex_
  void FinishOnce(const grpc::Status& status);  // needs mutex_

  const SnapshotStore& store_;
  QueryMetrics& metrics_;
  CallGate& gate_;
  v1alpha1::EvaluateWheelsRequest request_;  // owned by the reading side
  v1alpha1::EvaluateWheelsResponse responses_[2];

  std::mutex mutex_;        // reactions may run at the same time
  int next_ = 0;            // response that the next answer goes to
  bool answering_ = false;  // responses_[next_] is being filled
  bool answered_ = false;   // responses_[next_] waits to be written
  bool writing_ = false;    // responses_[1 - next_] is being written
  bool reads_done_ = false;
  bool draining_ = false;
  bool finished_ = false;
};

}  // namespace grouser::server
