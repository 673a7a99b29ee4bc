#include "server/query/terrain_server.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cstdint>
#include <stdexcept>
#include <utility>

#include "server/net/build_info.h"

namespace grouser::server {
namespace {

const std::string kTerrain = v1alpha1::TerrainService::service_full_name();
const std::string kVehicles = v1alpha1::VehicleService::service_full_name();
const std::string kOperator = v1alpha1::OperatorService::service_full_name();

constexpr char kProgram[] = "grouser-server";

std::unique_ptr<QueryLog> MakeQueryLog(const ServerConfig& config) {
  if (config.query_log.empty()) return nullptr;
  v1alpha1::QueryLogHeader header;
  *header.mutable_server() = MakeBuildInfo(kProgram);
  try {
    return std::make_unique<QueryLog>(
        QueryLogOptions{config.query_log, std::uint64_t{1'000'000} * config.query_log_limit_mb,
                        config.query_log_files},
        header);
  } catch (const QueryLogRefused& e) {
    throw QueryLogRefused(std::string("query-log: ") + e.what());
  }
}

ServerConfig Checked(ServerConfig config) {
  config.Validate();
  return config;
}

}  // namespace

TerrainServer::TerrainServer(ServerConfig config, ModelFactory factory)
    : config_(Checked(std::move(config))),
      repository_(config_.state_dir, config_.shipped_dir),
      tables_(config_.state_dir + "/tables", std::uint64_t{1'000'000} * config_.table_cache_mb),
      store_(repository_, std::move(factory), SnapshotStore::kUnnamed, &tables_,
             // What a model answers is counted from its first answer on.
             [this](const Snapshot& next) { metrics_.Adopt(next); }),
      query_log_(MakeQueryLog(config_)),
      service_({store_, metrics_, query_log_.get()}, gate_),
      fleet_(config_.vehicles),
      vehicle_service_(fleet_, gate_, config_.vehicle_threads),
      operator_service_(MakeBuildInfo(kProgram), gate_) {
  for (const std::string& problem : fleet_.problems()) spdlog::error("vehicle: {}", problem);
  if (!config_.vehicles.empty()) spdlog::info("serving {} vehicle(s)", fleet_.vehicles().size());
}

void TerrainServer::Load() {
  Take(store_.Refresh());
  const auto snapshot = store_.Current();
  if (!snapshot->loading() && snapshot->models().empty()) {
    spdlog::warn("no model to serve in {} or '{}'; queries are answered NOT_FOUND",
                 config_.state_dir, config_.shipped_dir);
  }
}

void TerrainServer::Start(const NetOptions& options, std::function<void()> on_unreachable) {
  const std::vector<NamedService> services = {
      {&service_, kTerrain}, {&vehicle_service_, kVehicles}, {&operator_service_, kOperator}};
  policy_ = std::make_unique<AccessPolicy>(options);
  grpc_ =
      std::make_unique<GrpcServer>(options, services, gate_, *policy_, std::move(on_unreachable));
  if (config_.lcm) {
    lcm_ = std::make_unique<LcmServer>(config_.lcm_url, config_.lcm_interface, store_, metrics_,
                                       query_log_.get());
  }
  grpc_->SetServing(kTerrain, false);  // until Load
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
    Take(outcome);
  } catch (const std::exception& e) {
    refresh_failures_.Add();
    if (last_failure_ == e.what()) return;
    last_failure_ = e.what();
    spdlog::error("repository: {}; the present models stay live", last_failure_);
  }
}

void TerrainServer::Take(const SnapshotStore::Outcome& outcome) {
  for (const auto& problem : outcome.news) spdlog::error("model: {}", problem);
  if (!outcome.changed) return;
  const auto snapshot = store_.Current();
  grpc_->SetServing(kTerrain, !snapshot->models().empty());
  problems_.Set(outcome.problems.size());
  {
    const std::lock_guard<std::mutex> lock(unresolved_mutex_);
    unresolved_ = outcome.unresolved;
  }
  spdlog::info("serving generation {} with {} model(s)", snapshot->generation(),
               snapshot->models().size());
}

const std::vector<std::string>& TerrainServer::ServiceNames() {
  static const std::vector<std::string> names = {kTerrain, kVehicles, kOperator};
  return names;
}

std::vector<std::string> TerrainServer::WhyNotReady() const {
  std::vector<std::string> reasons;
  const auto snapshot = store_.Current();
  if (snapshot->models().empty()) {
    reasons.push_back(snapshot->loading() ? "models are being loaded" : "no model is served");
  }
  const std::lock_guard<std::mutex> lock(unresolved_mutex_);
  for (const std::string& name : unresolved_) reasons.push_back("not answered: " + name);
  return reasons;
}

MetricPage TerrainServer::Metrics() const {
  MetricPage page;
  const auto snapshot = store_.Current();
  page.AddGauge("grouser_ready", "1: every name that should be answered is.",
                WhyNotReady().empty() ? 1 : 0);
  page.AddGauge("grouser_snapshot_generation", "Of the models and aliases that are served.",
                static_cast<double>(snapshot->generation()));
  page.AddGauge("grouser_models", "Models that are served.",
                static_cast<double>(snapshot->models().size()));
  page.AddGauge("grouser_repository_problems",
                "Files and aliases that were left out, or kept as before, when last read.",
                static_cast<double>(problems_.value()));
  page.AddCounter("grouser_repository_failures_total",
                  "Times that the folders of models could not be read.",
                  static_cast<double>(refresh_failures_.value()));
  page.AddGauge("grouser_vehicles", "Vehicles that are served.",
                static_cast<double>(fleet_.vehicles().size()));
  page.AddGauge("grouser_vehicle_problems", "Vehicle files that could not be read at the start.",
                static_cast<double>(fleet_.problems().size()));
  metrics_.AddTo(&page);
  vehicle_service_.AddTo(&page);
  if (query_log_) query_log_->AddTo(&page);
  if (lcm_) lcm_->AddTo(&page);
  return page;
}

}  // namespace grouser::server
