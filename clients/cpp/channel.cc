#include "clients/cpp/channel.h"

#include <google/protobuf/wrappers.pb.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/codegen/proto_utils.h>  // protobuf messages as those of a call

#include "clients/cpp/client_error.h"
#include "clients/cpp/credentials.h"
#include "grouser/v1alpha1/operator_service.grpc.pb.h"

namespace grouser::client {
namespace {

// 10,000 states with all parts of the uncertainty take some 4 MB.
constexpr int kMaxReceiveBytes = 64 * 1024 * 1024;

// A server that is gone without a word (power, cable) is noticed after the sum, while a call is
// under way. Servers take pings every 10 s.
constexpr int kKeepaliveMs = 15000;
constexpr int kKeepaliveTimeoutMs = 5000;
// Between two tries to reach a server that is not there.
constexpr int kFirstReconnectMs = 100;
constexpr int kLastReconnectMs = 1000;
// One try to connect may take so long.
constexpr int kConnectMs = 1000;

}  // namespace

std::shared_ptr<grpc::Channel> MakeChannel(const Server& server) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxReceiveBytes);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);  // as many as a quiet watch takes
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kFirstReconnectMs);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kLastReconnectMs);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kConnectMs);
  // http_proxy names a machine elsewhere: it cannot reach this one's loopback interface.
  if (IsLocal(server.address)) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  return grpc::CreateCustomChannel(server.address, MakeCredentials(server), arguments);
}

std::shared_ptr<grpc::Channel> MakeChannel(const std::string& address) {
  return MakeChannel(Server{address, {}});
}

std::chrono::system_clock::time_point DeadlineAfter(Milliseconds limit) {
  return std::chrono::system_clock::now() + limit;
}

bool IsServing(const Server& server, const std::string& service, Milliseconds deadline) {
  // HealthCheckRequest {string service = 1}; HealthCheckResponse {enum status = 1}. Debian ships
  // no generated code for them: these have the same bytes on the wire.
  google::protobuf::StringValue request;
  request.set_value(service);
  google::protobuf::UInt32Value response;
  constexpr std::uint32_t kServing = 1;
  grpc::TemplatedGenericStub<google::protobuf::StringValue, google::protobuf::UInt32Value> stub(
      MakeChannel(server));
  grpc::ClientContext context;
  context.set_deadline(DeadlineAfter(deadline));
  grpc::CompletionQueue queue;
  const auto call =
      stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check", request, &queue);
  grpc::Status status;
  call->StartCall();
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  ThrowUnlessOk(status, server);
  return response.value() == kServing;
}

bool IsServing(const std::string& address, const std::string& service, Milliseconds deadline) {
  return IsServing(Server{address, {}}, service, deadline);
}

v1alpha1::GetBuildInfoResponse GetBuildInfo(const Server& server, Milliseconds deadline) {
  const auto stub = v1alpha1::OperatorService::NewStub(MakeChannel(server));
  return Call(*stub, &v1alpha1::OperatorService::Stub::GetBuildInfo,
              v1alpha1::GetBuildInfoRequest(), server, deadline);
}

}  // namespace grouser::client
