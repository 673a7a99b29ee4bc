#include "clients/cpp/channel.h"

#include <google/protobuf/wrappers.pb.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/codegen/proto_utils.h>  // protobuf messages as those of a call

#include "clients/cpp/client_error.h"
#include "grouser/v1alpha1/operator_service.grpc.pb.h"

namespace grouser::client {
namespace {

// 10,000 states with all parts of the uncertainty take some 4 MB.
constexpr int kMaxReceiveBytes = 64 * 1024 * 1024;

// http_proxy names a machine elsewhere: it cannot reach this one's loopback interface.
bool IsLoopback(const std::string& address) {
  for (const char* start : {"localhost:", "127.", "[::1]:"}) {
    if (address.starts_with(start)) return true;
  }
  return false;
}

}  // namespace

std::shared_ptr<grpc::Channel> MakeChannel(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxReceiveBytes);
  if (IsLoopback(address)) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

std::chrono::system_clock::time_point DeadlineAfter(Milliseconds limit) {
  return std::chrono::system_clock::now() + limit;
}

bool IsServing(const std::string& address, const std::string& service, Milliseconds deadline) {
  // HealthCheckRequest {string service = 1}; HealthCheckResponse {enum status = 1}. Debian ships
  // no generated code for them: these have the same bytes on the wire.
  google::protobuf::StringValue request;
  request.set_value(service);
  google::protobuf::UInt32Value response;
  constexpr std::uint32_t kServing = 1;
  grpc::TemplatedGenericStub<google::protobuf::StringValue, google::protobuf::UInt32Value> stub(
      MakeChannel(address));
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
  ThrowUnlessOk(status, address);
  return response.value() == kServing;
}

v1alpha1::GetBuildInfoResponse GetBuildInfo(const std::string& address, Milliseconds deadline) {
  const auto stub = v1alpha1::OperatorService::NewStub(MakeChannel(address));
  return Call(*stub, &v1alpha1::OperatorService::Stub::GetBuildInfo,
              v1alpha1::GetBuildInfoRequest(), address, deadline);
}

}  // namespace grouser::client
