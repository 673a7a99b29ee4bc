#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/core/config.h"
#include "server/core/query_metrics.h"
#include "server/core/repository.h"
#include "server/core/snapshot_store.h"
#include "server/net/grpc_server.h"
#include "server/net/operator_service.h"
#include "server/query/grpc/terrain_service.h"
#include "server/query/lcm/lcm_server.h"
#include "server/vehicle/fleet.h"
#include "server/vehicle/vehicle_service.h"

namespace grouser::server {

/// grouser-server without its main loop: repository, snapshot, vehicles, gRPC, LCM.
class TerrainServer {
 public:
  /// Loads the vehicles; one that cannot be read is logged and left out. Opens the query log.
  /// Throws std::invalid_argument on a bad configuration, else as QueryLog.
  TerrainServer(ServerConfig config, ModelFactory factory);

  /// Opens gRPC and LCM. Throws as AccessPolicy and GrpcServer, and std::runtime_error naming what
  /// cannot start. `on_unreachable`: see GrpcServer.
  void Start(const NetOptions& options, std::function<void()> on_unreachable);
  /// Loads the models, after Start: until then wheel queries get UNAVAILABLE. Throws
  /// std::runtime_error when the repository cannot be read. Store thread.
  void Load();
  /// Ends a Load or Refresh under way early, without effect. Any thread.
  void StopLoading() { store_.Stop(); }
  /// "ready grpc=ADDR lcm=URL generation=G".
  std::string ReadyLine() const;
  GrpcServer& grpc() { return *grpc_; }

  /// Puts a changed repository live; logs problems. Store thread only. Never
  /// throws: what cannot be read leaves the old snapshot in place.
  void Refresh() noexcept;

  /// Why queries that should be answered are not; none: all are. Any thread.
  std::vector<std::string> WhyNotReady() const;
  /// Any thread, once it was started.
  MetricPage Metrics() const;
  /// From Start on.
  AccessPolicy& policy() { return *policy_; }
  CallGate& gate() { return gate_; }
  const v1alpha1::GetBuildInfoResponse& build() const { return operator_service_.build(); }
  static const std::vector<std::string>& ServiceNames();

 private:
  void Take(const SnapshotStore::Outcome& outcome);

  ServerConfig config_;
  Repository repository_;
  TableCache tables_;
  QueryMetrics metrics_;
  SnapshotStore store_;
  std::string last_failure_;  // said once, not every poll
  Counter problems_, refresh_failures_;
  mutable std::mutex unresolved_mutex_;
  std::vector<std::string> unresolved_;
  CallGate gate_;
  std::unique_ptr<QueryLog> query_log_;   // null: none
  std::unique_ptr<AccessPolicy> policy_;  // from Start on
  TerrainService service_;
  Fleet fleet_;
  VehicleService vehicle_service_;
  OperatorService operator_service_;
  std::unique_ptr<GrpcServer> grpc_;
  std::unique_ptr<LcmServer> lcm_;
};

}  // namespace grouser::server
