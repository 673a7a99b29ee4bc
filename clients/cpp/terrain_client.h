#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "clients/cpp/channel.h"
#include "grouser/v1alpha1/terrain_service.grpc.pb.h"

namespace grouser::client {

/// One StreamWheels call. Send() and Receive() may run on two threads, one
/// each; keep a few batches in flight. Errors of single messages come in band
/// (response.has_error()) and do not end the stream.
class WheelStreamSession {
 public:
  /// False when the stream has ended; Finish() tells why. An answer that does not come within the
  /// limit of OpenStream() ends it with DEADLINE_EXCEEDED.
  bool Send(const v1alpha1::EvaluateWheelsRequest& request);
  bool Receive(v1alpha1::EvaluateWheelsResponse* response);
  /// Half-closes, drops what is still to come, throws ClientError unless the
  /// stream ended well.
  void Finish();
  /// Ends a stream that was not finished.
  ~WheelStreamSession();

 private:
  friend class TerrainClient;
  using Stream =
      grpc::ClientReaderWriter<v1alpha1::EvaluateWheelsRequest, v1alpha1::EvaluateWheelsResponse>;
  using Clock = std::chrono::steady_clock;
  explicit WheelStreamSession(Milliseconds receive_limit);
  bool Read(v1alpha1::EvaluateWheelsResponse* response);
  void Watch(const std::stop_token& stop);

  Server server_;
  std::unique_ptr<grpc::ClientContext> context_ = std::make_unique<grpc::ClientContext>();
  std::unique_ptr<Stream> stream_;
  bool finished_ = false;
  const Milliseconds receive_limit_;
  // When the answer that is waited for is due. Looked at every receive_limit_ by a thread that
  // nobody wakes, so that a message costs nothing more.
  std::atomic<Clock::time_point> due_{Clock::time_point::max()};
  std::atomic<bool> late_{false};
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread watch_;  // last: it uses the others
};

/// Wheel queries over gRPC; thread-safe. Every call throws ClientError with
/// status and text when it fails.
class TerrainClient {
 public:
  explicit TerrainClient(std::string address, Milliseconds deadline = Milliseconds(5000))
      : TerrainClient(Server{std::move(address), {}}, deadline) {}
  /// Throws as MakeCredentials.
  explicit TerrainClient(Server server, Milliseconds deadline = Milliseconds(5000));

  v1alpha1::EvaluateWheelsResponse Evaluate(const v1alpha1::EvaluateWheelsRequest& request) const;
  /// The same, reusing the memory of `response`.
  void Evaluate(const v1alpha1::EvaluateWheelsRequest& request,
                v1alpha1::EvaluateWheelsResponse* response) const;
  /// All models, of all pages.
  v1alpha1::ListModelsResponse ListModels() const;
  v1alpha1::GetModelResponse GetModel(const std::string& model) const;
  v1alpha1::ExplainResponse Explain(const v1alpha1::ExplainRequest& request) const;
  /// Opens a stream without a deadline; each of its answers must come within that of a call, from
  /// when it is waited for.
  std::unique_ptr<WheelStreamSession> OpenStream() const;

  const std::string& address() const { return server_.address; }

 private:
  Server server_;
  Milliseconds deadline_;
  std::unique_ptr<v1alpha1::TerrainService::Stub> stub_;
};

}  // namespace grouser::client
