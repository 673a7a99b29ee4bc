#include "clients/cpp/channel.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <vector>

#include "clients/cpp/client_error.h"

namespace grouser::client {
namespace {

// 10,000 states with all parts of the uncertainty take some 4 MB.
constexpr int kMaxReceiveBytes = 64 * 1024 * 1024;

constexpr const char* kHealthCheck = "/grpc.health.v1.Health/Check";
// HealthCheckRequest {string service = 1}; HealthCheckResponse {enum status =
// 1}. Debian ships no generated code for this one message.
constexpr std::uint32_t kServiceTag = (1 << 3) | 2;
constexpr std::uint32_t kStatusTag = (1 << 3) | 0;
constexpr std::uint32_t kServing = 1;

grpc::ByteBuffer EncodeHealthRequest(const std::string& service) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream out(&stream);
    out.WriteTag(kServiceTag);
    out.WriteVarint32(static_cast<std::uint32_t>(service.size()));
    out.WriteString(service);
  }
  grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

bool DecodeServing(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  if (!buffer.Dump(&slices).ok()) return false;
  std::string bytes;
  for (const auto& slice : slices) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  google::protobuf::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                            static_cast<int>(bytes.size()));
  std::uint32_t status = 0;
  return in.ReadTag() == kStatusTag && in.ReadVarint32(&status) && status == kServing;
}

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
  grpc::GenericStub stub(MakeChannel(address));
  grpc::ClientContext context;
  context.set_deadline(DeadlineAfter(deadline));
  grpc::CompletionQueue queue;
  const auto call =
      stub.PrepareUnaryCall(&context, kHealthCheck, EncodeHealthRequest(service), &queue);
  grpc::ByteBuffer response;
  grpc::Status status;
  call->StartCall();
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  ThrowUnlessOk(status, address);
  return DecodeServing(response);
}

}  // namespace grouser::client
