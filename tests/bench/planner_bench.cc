#include "tests/bench/planner_bench.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <memory>
#include <numbers>

#include "clients/cpp/vehicle_client.h"
#include "surrogate/vehicle/messages.h"
#include "surrogate/vehicle/speed_plan.h"
#include "surrogate/vehicle/vehicle_file.h"
#include "tests/bench/server_bench.h"
#include "tests/bench/surrogate_bench.h"

namespace grouser::bench {
namespace {

using namespace vehicle;
using Clock = std::chrono::steady_clock;

constexpr double kStep = 0.1;     // [m]
constexpr double kFaster = 1.01;  // of a motion near one that is solved
constexpr std::size_t kDraws = 32;

struct Case {
  const char* vehicle;
  double limit_m_per_s, curvature_per_m;  // of the tightest curves
};
constexpr Case kCases[] = {
    {"husky", 1.5, 0.8}, {"cart", 6, 0.3}, {"atv", 3, 0.25}, {"rover", 0.1, 1}};

std::vector<PathPoint> PathOf(const std::string& name, double curvature, std::size_t soils,
                              std::size_t points) {
  std::vector<PathPoint> path(points);
  for (std::size_t i = 0; i < points; ++i) {
    PathPoint& p = path[i];
    p.s_m = kStep * static_cast<double>(i);
    if (name == "straight") continue;
    const auto wave = [&](double length) {
      return std::sin(2 * std::numbers::pi * p.s_m / length);
    };
    p.curvature_per_m = curvature * wave(31) * wave(47);
    if (name == "curvy") continue;
    p.grade_rad = 0.12 * wave(53);
    p.bank_rad = 0.06 * wave(23);
    if (name == "mixed") p.soil = static_cast<std::uint8_t>(i / 125 % soils);
  }
  return path;
}

// Processor time of this thread [ms].
double ProcessorMs() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// The same plan asked of a server.
class ServerPlan {
 public:
  ServerPlan(const std::string& server, const std::string& vehicle, std::span<const PathPoint> path,
             const SpeedOptions& options)
      : client_(server, client::Milliseconds(60000)), plan_(path.size()) {
    request_.set_vehicle(vehicle);
    ToMessage(path, request_.mutable_path());
    client::SetOptions(options, &request_);
  }

  double Ms() {
    const auto start = Clock::now();
    client_.PlanSpeed(request_, &response_);
    const std::chrono::duration<double, std::milli> wall = Clock::now() - start;
    return wall.count();
  }
  /// Points of the last answer that differ.
  std::size_t Differ(std::span<const SpeedPoint> from) {
    FromMessage(response_.plan(), plan_);
    std::size_t count = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
      const SpeedPoint &a = plan_[i], &b = from[i];
      count += a.speed_m_per_s != b.speed_m_per_s || a.safe_m_per_s != b.safe_m_per_s ||
               a.acceleration_m_per_s2 != b.acceleration_m_per_s2 || a.binding != b.binding ||
               a.safe_binding != b.safe_binding || a.shortfall != b.shortfall || a.holds != b.holds;
    }
    return count;
  }

 private:
  client::VehicleClient client_;
  v1alpha1::PlanSpeedRequest request_;
  v1alpha1::PlanSpeedResponse response_;
  std::vector<SpeedPoint> plan_;
};

/// One row and what it runs.
class PlanCell {
 public:
  PlanCell(const Case& c, const std::string& path, std::size_t points)
      : file_(ReadVehicle(
            FindShipped("surrogate/vehicle/shipped/" + std::string(c.vehicle) + ".vehicle.yaml"))),
        path_(PathOf(path, c.curvature_per_m, file_.grounds.soils.size(), points)),
        planner_(file_.vehicle, file_.grounds, points),
        solver_(file_.vehicle, file_.grounds),
        plan_(points),
        motions_(points),
        near_(points),
        drawn_(points),
        solutions_(points) {
    options_.speed_limit_m_per_s = c.limit_m_per_s;
    row_.vehicle = c.vehicle;
    row_.path = path;
    row_.points = points;
    row_.wheels = file_.vehicle.wheels.size();
    row_.not_held = planner_.Plan(path_, options_, plan_);
    for (std::size_t i = 0; i < points; ++i) {
      Motion& m = motions_[i];
      m = Motion::OnPath(plan_[i].speed_m_per_s, path_[i].curvature_per_m);
      m.acceleration_m_per_s2 = plan_[i].acceleration_m_per_s2;
      m.grade_rad = path_[i].grade_rad;
      m.bank_rad = path_[i].bank_rad;
      m.soil.fill(path_[i].soil);
      near_[i] = m;
      near_[i].v_x_m_per_s *= kFaster;
      near_[i].yaw_rate_rad_per_s *= kFaster;
      drawn_[i] = near_[i];
      drawn_[i].draw = static_cast<int>(i % kDraws);
    }
    solver_.UseDraws(std::make_shared<const GroundDraws>(file_.grounds, kDraws));
    const long before = Allocations();
    Pass(nullptr);
    row_.allocations = Allocations() - before;
  }

  /// After the allocations of all rows were counted: a client has threads of its own.
  void Connect(const std::string& server) {
    server_ = std::make_unique<ServerPlan>(server, row_.vehicle, path_, options_);
    server_->Ms();
    row_.grpc_differ = server_->Differ(plan_);
  }

  void Run() {
    Pass(&times_);
    if (server_) times_.grpc.push_back(server_->Ms());
  }

  PlannerRow Row() {
    for (auto* times :
         {&times_.plan, &times_.cpu, &times_.cold, &times_.warm, &times_.draw, &times_.grpc}) {
      std::sort(times->begin(), times->end());
    }
    PlannerRow row = row_;
    row.plan_p50_ms = Quantile(times_.plan, 0.5);
    row.plan_p99_ms = Quantile(times_.plan, 0.99);
    row.plan_cpu_ms = Quantile(times_.cpu, 0.5);
    if (server_) {
      row.grpc_p50_ms = Quantile(times_.grpc, 0.5);
      row.grpc_p99_ms = Quantile(times_.grpc, 0.99);
    }
    row.solve_cold_us = 1e3 / static_cast<double>(path_.size()) * Quantile(times_.cold, 0.5);
    row.solve_warm_us = 1e3 / static_cast<double>(path_.size()) * Quantile(times_.warm, 0.5);
    row.solve_draw_us = 1e3 / static_cast<double>(path_.size()) * Quantile(times_.draw, 0.5);
    return row;
  }

 private:
  struct Times {
    std::vector<double> plan, cpu, cold, warm, draw, grpc;  // [ms]
  };

  void Pass(Times* times) {
    const auto start = Clock::now();
    const double t0 = ProcessorMs();
    planner_.Plan(path_, options_, plan_);
    const double t1 = ProcessorMs();
    const std::chrono::duration<double, std::milli> wall = Clock::now() - start;
    solver_.Solve(motions_, solutions_, false);
    const double t2 = ProcessorMs();
    solver_.Solve(near_, solutions_, true);
    const double t3 = ProcessorMs();
    solver_.Solve(drawn_, solutions_, true);
    const double t4 = ProcessorMs();
    if (times == nullptr) return;
    times->plan.push_back(wall.count());
    times->cpu.push_back(t1 - t0);
    times->cold.push_back(t2 - t1);
    times->warm.push_back(t3 - t2);
    times->draw.push_back(t4 - t3);
  }

  VehicleFile file_;
  std::vector<PathPoint> path_;
  SpeedOptions options_;
  SpeedPlanner planner_;
  Solver solver_;
  std::vector<SpeedPoint> plan_;
  std::vector<Motion> motions_, near_, drawn_;
  std::vector<Solution> solutions_;
  PlannerRow row_;
  Times times_;
  std::unique_ptr<ServerPlan> server_;
};

}  // namespace

std::vector<PlannerRow> MeasurePlanner(const PlannerOptions& options) {
  std::vector<std::unique_ptr<PlanCell>> cells;
  for (const Case& c : kCases) {
    for (const char* path : {"straight", "curvy", "hilly", "mixed"}) {
      const bool asked = (options.vehicle.empty() || options.vehicle == c.vehicle) &&
                         (options.path.empty() || options.path == path);
      if (asked) cells.push_back(std::make_unique<PlanCell>(c, path, options.points));
    }
  }
  for (auto& cell : cells) {
    if (!options.server.empty()) cell->Connect(options.server);
  }
  for (int repetition = 0; repetition < options.repetitions; ++repetition) {
    for (auto& cell : cells) cell->Run();
  }
  std::vector<PlannerRow> rows;
  for (const auto& cell : cells) rows.push_back(cell->Row());
  return rows;
}

}  // namespace grouser::bench
