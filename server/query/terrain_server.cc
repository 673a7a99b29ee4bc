#include "server/query/terrain_server.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

namespace grouser::server {
namespace {

const std::string kTerrain = v1alpha1::TerrainService::service_full_name();
const std::string kVehicles = v1alpha1::VehicleService::service_full_name();

ServerConfig Checked(ServerConfig config) {
  config.Validate();
  return config;
}

}  // namespace

TerrainServer::TerrainServer(ServerConfig config, ModelFactory factory)
    : config_(Checked(std::move(config))),
      repository_(config_.state_dir, config_.shipped_dir),
      store_(repository_, std::move(factory)),
      service_(store_, gate_),
      fleet_(config_.vehicles),
      vehicle_service_(fleet_, gate_, config_.vehicle_threads) {
  for (const std::string& problem : fleet_.problems()) spdlog::error("vehicle: {}", problem);
  if (!config_.vehicles.empty()) spdlog::info("serving {} vehicle(s)", fleet_.vehicles().size());
  Log(store_.Refresh());
  if (store_.Current()->models().empty()) {
    spdlog::warn("no model to serve in {} or '{}'; queries are answered NOT_FOUND",
                 config_.state_dir, config_.shipped_dir);
  }
}

void TerrainServer::Start(const NetOptions& options, std::function<void()> on_unreachable) {
  const std::vector<NamedService> services = {{&service_, kTerrain},
                                              {&vehicle_service_, kVehicles}};
  policy_ = std::make_unique<AccessPolicy>(options);
  grpc_ =
      std::make_unique<GrpcServer>(options, services, gate_, *policy_, std::move(on_unreachable));
  if (config_.lcm) {
    lcm_ = std::make_unique<LcmServer>(config_.lcm_url, config_.lcm_interface, store_);
  }
  grpc_->SetServing(kTerrain, !store_.Current()->models().empty());
  grpc_->SetServing(kVehicles, !fleet_.vehicles().empty());
}

std::string TerrainServer::ReadyLine() const {
  return fmt::format("ready grpc={} lcm={} generation={}", grpc_->address(),
                     lcm_ ? lcm_->url() : "off", store_.Current()->generation());
}

void TerrainServer::Refresh() noexcept {
  try {
    const auto outcome = store_.Refresh();
    last_failure_.clear();
    Log(outcome);
    if (outcome.changed && grpc_) grpc_->SetServing(kTerrain, !store_.Current()->models().empty());
  } catch (const std::exception& e) {
    if (last_failure_ == e.what()) return;
    last_failure_ = e.what();
    spdlog::error("repository: {}; the present models stay live", last_failure_);
  }
}

void TerrainServer::Log(const SnapshotStore::Outcome& outcome) {
  for (const auto& problem : outcome.problems) spdlog::error("model: {}", problem);
  if (!outcome.changed) return;
  const auto snapshot = store_.Current();
  spdlog::info("serving generation {} with {} model(s)", snapshot->generation(),
               snapshot->models().size());
}

}  // namespace grouser::server
