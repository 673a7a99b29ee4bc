#include "server/net/self_probe.h"

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <spdlog/spdlog.h>

#include <condition_variable>
#include <mutex>

namespace grouser::server {
namespace {

grpc::Status AskHealth(const std::string& address,
                       const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                       const std::stop_token& stop) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // a new connection each time
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  grpc::GenericStub stub(grpc::CreateCustomChannel(address, credentials, arguments));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + SelfProbe::kDeadline);
  const std::stop_callback cancel(stop, [&context] { context.TryCancel(); });
  grpc::CompletionQueue queue;
  grpc::Slice empty;  // of service "": the whole server
  const auto call = stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check",
                                          grpc::ByteBuffer(&empty, 1), &queue);
  grpc::ByteBuffer response;
  grpc::Status status;
  call->StartCall();
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  return status;
}

}  // namespace

SelfProbe::SelfProbe(std::string address, std::shared_ptr<grpc::ChannelCredentials> credentials,
                     std::chrono::duration<double> period, std::function<bool()> skip,
                     std::function<void()> on_unreachable)
    : thread_([=](const std::stop_token& stop) {
        std::mutex mutex;
        std::condition_variable_any wake;
        for (int failures = 0; failures < kFailures;) {
          std::unique_lock lock(mutex);
          wake.wait_for(lock, stop, period, [] { return false; });
          if (stop.stop_requested()) return;
          if (skip()) continue;
          const grpc::Status status = AskHealth(address, credentials, stop);
          if (stop.stop_requested()) return;
          failures = status.ok() ? 0 : failures + 1;
          if (status.ok()) continue;
          spdlog::error("grpc: {}: cannot reach myself ({} of {}): {}", address, failures,
                        kFailures, status.error_message());
        }
        on_unreachable();
      }) {}

}  // namespace grouser::server
