#include "clients/cpp/channel.h"

#include <google/protobuf/wrappers.pb.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/codegen/proto_utils.h>  // protobuf messages as those of a call

#include "clients/cpp/client_error.h"
#include "clients/cpp/credentials.h"

namespace grouser::client {
namespace {

// 10,000 states with all parts of the uncertainty take some 4 MB.
constexpr int kMaxReceiveBytes = 64 * 1024 * 1024;

}  // namespace

std::shared_ptr<grpc::Channel> MakeChannel(const Server& server) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxReceiveBytes);
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

}  // namespace grouser::client
