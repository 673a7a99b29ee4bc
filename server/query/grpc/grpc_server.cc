#include "server/query/grpc/grpc_server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server_builder.h>

#include <stdexcept>

namespace grouser::server {
namespace {

constexpr const char* kServiceName = "grouser.v1alpha1.TerrainService";
// Memory that gRPC may hold for messages; beyond it calls are refused.
constexpr std::size_t kQuotaBytes = 512ull * 1024 * 1024;

}  // namespace

GrpcServer::GrpcServer(const ServerConfig& config, const SnapshotStore& store) : service_(store) {
  // Both are registries of gRPC itself and must be set before a builder exists.
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();

  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(config.grpc_address, grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service_);
  builder.SetMaxReceiveMessageSize(config.max_receive_bytes);
  builder.SetResourceQuota(grpc::ResourceQuota("grouser-server").Resize(kQuotaBytes));
  // With it a second server would silently share the port.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, config.max_calls_per_connection);
  server_ = builder.BuildAndStart();
  if (!server_ || port == 0) {
    throw std::runtime_error("grpc: " + config.grpc_address +
                             ": cannot listen; is the port in use by another program?");
  }
  const std::size_t colon = config.grpc_address.rfind(':');
  address_ = config.grpc_address.substr(0, colon + 1) + std::to_string(port);
}

GrpcServer::~GrpcServer() { Drain(std::chrono::milliseconds(0)); }

void GrpcServer::SetServing(bool serving) {
  server_->GetHealthCheckService()->SetServingStatus(kServiceName, serving);
}

void GrpcServer::Drain(std::chrono::milliseconds limit) {
  if (!server_) return;
  server_->GetHealthCheckService()->Shutdown();
  service_.Drain();
  server_->Shutdown(std::chrono::system_clock::now() + limit);
  server_->Wait();
  server_.reset();
}

}  // namespace grouser::server
