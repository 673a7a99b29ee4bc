#include "tests/bench/trajectory_bench.h"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "clients/cpp/vehicle_client.h"
#include "tests/bench/server_bench.h"

namespace grouser::bench {
namespace {

using Clock = std::chrono::steady_clock;
using client::VehicleClient;

constexpr int kMotionsOfACall = 3000;  // the most that a server takes

double ServerMs(const google::protobuf::Duration& latency) {
  return 1e-6 *
         static_cast<double>(google::protobuf::util::TimeUtil::DurationToNanoseconds(latency));
}

double SpeedOf(int i) { return 0.5 + 0.1 * std::sin(0.7 * i); }
double YawRateOf(int i) { return 0.3 * std::sin(0.11 * i); }

/// Calls of one method that ask all steps.
template <class Request, class Response>
class Way {
 public:
  Way(std::string name, Response (VehicleClient::*method)(const Request&) const,
      std::vector<Request> requests)
      : method_(method), requests_(std::move(requests)), responses_(requests_.size()) {
    row_.way = std::move(name);
    row_.calls = requests_.size();
  }

  void Run(const VehicleClient& client) {
    const auto start = Clock::now();
    double server_ms = 0;
    for (std::size_t k = 0; k < requests_.size(); ++k) {
      responses_[k] = (client.*method_)(requests_[k]);
      server_ms += ServerMs(responses_[k].latency());
    }
    const std::chrono::duration<double, std::milli> spent = Clock::now() - start;
    wall_.push_back(spent.count());
    server_.push_back(server_ms);
  }

  TrajectoryBenchRow Row() {
    for (std::size_t k = 0; k < requests_.size(); ++k) {
      row_.sent_bytes += requests_[k].ByteSizeLong();
      row_.answered_bytes += responses_[k].ByteSizeLong();
    }
    std::sort(wall_.begin(), wall_.end());
    std::sort(server_.begin(), server_.end());
    row_.p50_ms = Quantile(wall_, 0.5);
    row_.server_p50_ms = Quantile(server_, 0.5);
    return row_;
  }
  const std::vector<Response>& responses() const { return responses_; }

 private:
  Response (VehicleClient::*method_)(const Request&) const;
  std::vector<Request> requests_;
  std::vector<Response> responses_;
  std::vector<double> wall_, server_;  // [ms]
  TrajectoryBenchRow row_;
};

template <class Request>
std::vector<Request> Motions(const TrajectoryBenchOptions& options) {
  const int n = options.trajectories * options.steps;
  std::vector<Request> requests;
  for (int first = 0; first < n; first += kMotionsOfACall) {
    Request& request = requests.emplace_back();
    request.set_vehicle(options.vehicle);
    v1alpha1::TwistForm& twist = *request.mutable_motions()->mutable_twist();
    for (int i = first; i < std::min(n, first + kMotionsOfACall); ++i) {
      twist.add_v_x_m_per_s(SpeedOf(i));
      twist.add_yaw_rate_rad_per_s(YawRateOf(i));
    }
  }
  return requests;
}

v1alpha1::EvaluateTrajectoriesRequest Trajectories(const TrajectoryBenchOptions& options) {
  v1alpha1::EvaluateTrajectoriesRequest request;
  request.set_vehicle(options.vehicle);
  v1alpha1::Trajectories& t = *request.mutable_trajectories();
  t.mutable_steps()->Resize(options.trajectories, static_cast<std::uint32_t>(options.steps));
  t.add_duration_s(0.1);
  for (int i = 0; i < options.trajectories * options.steps; ++i) {
    t.add_v_x_m_per_s(SpeedOf(i));
    t.add_yaw_rate_rad_per_s(YawRateOf(i));
  }
  return request;
}

void ThrowUnlessSame(const std::vector<v1alpha1::EnergyResponse>& energies,
                     const v1alpha1::EvaluateTrajectoriesResponse& trajectories) {
  google::protobuf::RepeatedField<double> watts;
  for (const auto& response : energies) watts.MergeFrom(response.powers().electric_w());
  const auto& theirs = trajectories.steps().electric_w();
  if (watts.size() == theirs.size() &&
      std::memcmp(watts.data(), theirs.data(), sizeof(double) * watts.size()) == 0) {
    return;
  }
  throw std::runtime_error("trajectories: other powers than Energy's, expected the same bits");
}

}  // namespace

std::vector<TrajectoryBenchRow> MeasureTrajectories(const TrajectoryBenchOptions& options) {
  const VehicleClient client(options.server, client::Milliseconds(60000));
  Way solve("Solve", &VehicleClient::Solve, Motions<v1alpha1::SolveRequest>(options));
  Way energy("Energy", &VehicleClient::Energy, Motions<v1alpha1::EnergyRequest>(options));
  v1alpha1::EvaluateTrajectoriesRequest costs = Trajectories(options), steps = costs, mean = costs;
  steps.set_with_steps(true);
  mean.set_interval_sds(0);
  const auto method = &VehicleClient::EvaluateTrajectories;
  Way whole("trajectories", method, std::vector{costs});
  Way each("trajectories, each step", method, std::vector{steps});
  Way alone("trajectories, no interval", method, std::vector{mean});
  for (int repetition = 0; repetition < options.repetitions; ++repetition) {
    solve.Run(client), energy.Run(client), whole.Run(client), each.Run(client), alone.Run(client);
    ThrowUnlessSame(energy.responses(), each.responses().front());
  }
  return {solve.Row(), energy.Row(), whole.Row(), each.Row(), alone.Row()};
}

void AddOptions(CLI::App* app, TrajectoryBenchOptions* options, bool* json) {
  app->add_option("--server", options->server, "grouser-server, HOST:PORT or unix:PATH")
      ->required();
  app->add_option("--vehicle", options->vehicle, "One of its vehicles")->capture_default_str();
  app->add_option("--trajectories", options->trajectories, "How many")
      ->check(CLI::Range(1, 30000))
      ->capture_default_str();
  app->add_option("--steps", options->steps, "Of each; at most 30000 in all")
      ->check(CLI::Range(1, 30000))
      ->capture_default_str();
  app->add_option("--repetitions", options->repetitions, "Of every row")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app->add_flag("--json", *json, "JSON on stdout");
}

void PrintTable(const std::vector<TrajectoryBenchRow>& rows) {
  fmt::print("{:26} {:>6} {:>12} {:>15} {:>10} {:>14}\n", "way", "calls", "sent bytes",
             "answered bytes", "p50 ms", "in server ms");
  for (const auto& r : rows) {
    fmt::print("{:26} {:>6} {:>12} {:>15} {:>10.2f} {:>14.2f}\n", r.way, r.calls, r.sent_bytes,
               r.answered_bytes, r.p50_ms, r.server_p50_ms);
  }
}

void PrintJson(const std::vector<TrajectoryBenchRow>& rows) {
  fmt::print("[");
  const char* separator = "\n";
  for (const auto& r : rows) {
    fmt::print(
        "{}  {{\"way\": \"{}\", \"calls\": {}, \"sent_bytes\": {}, \"answered_bytes\": {}, "
        "\"p50_ms\": {:.4f}, \"server_p50_ms\": {:.4f}}}",
        separator, r.way, r.calls, r.sent_bytes, r.answered_bytes, r.p50_ms, r.server_p50_ms);
    separator = ",\n";
  }
  fmt::print("\n]\n");
}

}  // namespace grouser::bench
