#pragma once

#include <grpcpp/server.h>

#include <chrono>
#include <memory>
#include <string>

#include "server/core/config.h"
#include "server/core/snapshot_store.h"
#include "server/query/grpc/terrain_service.h"

namespace grouser::server {

/// The gRPC side of grouser-server: TerrainService, standard health service,
/// reflection. Health of "grouser.v1alpha1.TerrainService" is SERVING while
/// there is a model.
class GrpcServer {
 public:
  /// Listens. Throws std::runtime_error "grpc: ADDR: ..." when it cannot, e.g.
  /// because the port is in use.
  GrpcServer(const ServerConfig& config, const SnapshotStore& store);
  ~GrpcServer();

  /// With the port that was really taken.
  const std::string& address() const { return address_; }

  void SetServing(bool serving);

  /// Says NOT_SERVING, ends streams, waits up to `limit` for calls under way,
  /// then cancels them. Idempotent.
  void Drain(std::chrono::milliseconds limit);

 private:
  TerrainService service_;
  std::unique_ptr<grpc::Server> server_;
  std::string address_;
};

}  // namespace grouser::server
