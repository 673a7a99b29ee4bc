#pragma once

#include <grpcpp/support/server_callback.h>

#include <deque>
#include <memory>
#include <mutex>
#include <optional>

#include "grouser/v1alpha1/jobs_service.pb.h"
#include "server/jobs/watch_hub.h"
#include "server/net/call_gate.h"

namespace grouser::server {

/// One WatchJob stream. Keeps itself alive until gRPC is done with it. Every
/// state is sent; of a slow reader's waiting progress only the latest. A reader that takes nothing
/// is cancelled, see LoadControl.
class WatchReactor final : public grpc::ServerWriteReactor<v1alpha1::WatchJobResponse>,
                           public JobWatcher,
                           public DrainableStream {
 public:
  WatchReactor(CallGate& gate, grpc::CallbackServerContext& context)
      : gate_(gate), context_(context) {}
  static std::shared_ptr<WatchReactor> Create(CallGate& gate, grpc::CallbackServerContext& context);

  void OnJob(const v1alpha1::Job& job) override;
  void OnStop() override { End(ShuttingDown()); }
  /// Nothing: a watch goes on until the workers are stopped, which OnStop tells.
  void BeginDrain() override {}
  /// Ends the stream after what waits was sent.
  void End(const grpc::Status& status);

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  /// Starts the next write or the finish where nothing is under way. gRPC may
  /// call back from within those, so they are called without the lock.
  void Pump();

  CallGate& gate_;
  grpc::CallbackServerContext& context_;
  LoadControl::Ticket ticket_;  // of the write under way
  std::mutex mutex_;
  std::deque<v1alpha1::Job> waiting_;
  v1alpha1::WatchJobResponse current_;
  std::optional<grpc::Status> end_;
  bool writing_ = false, finished_ = false;
  std::shared_ptr<WatchReactor> self_;
};

}  // namespace grouser::server
