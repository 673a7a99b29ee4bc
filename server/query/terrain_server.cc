#include "server/query/terrain_server.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "proto/records/model_file.h"

namespace grouser::server {
namespace {

ServerConfig Checked(ServerConfig config) {
  config.Validate();
  return config;
}

}  // namespace

TerrainServer::TerrainServer(ServerConfig config, ModelFactory factory)
    : config_(Checked(std::move(config))),
      repository_(config_.state_dir, config_.shipped_dir),
      store_(repository_, std::move(factory)) {
  Log(store_.Refresh());
  if (store_.Current()->models().empty()) {
    spdlog::warn("no model to serve in {} or '{}'; queries are answered NOT_FOUND",
                 config_.state_dir, config_.shipped_dir);
  }
}

void TerrainServer::Start() {
  grpc_ = std::make_unique<GrpcServer>(config_, store_);
  if (config_.lcm) {
    lcm_ = std::make_unique<LcmServer>(config_.lcm_url, config_.lcm_interface, store_);
  }
  grpc_->SetServing(!store_.Current()->models().empty());
  if (!config_.port_file.empty()) {
    records::WriteFileDurably(config_.port_file, "grpc=" + grpc_->address() + "\n");
  }
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
    if (outcome.changed && grpc_) grpc_->SetServing(!store_.Current()->models().empty());
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

void TerrainServer::Stop() {
  if (grpc_) grpc_->Drain(config_.drain_limit);
  lcm_.reset();
}

}  // namespace grouser::server
