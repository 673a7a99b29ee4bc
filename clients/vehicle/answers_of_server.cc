#include <fmt/format.h>

#include <algorithm>

#include "clients/cpp/client_error.h"
#include "clients/cpp/vehicle_client.h"
#include "clients/vehicle/answers.h"
#include "surrogate/vehicle/mixture_ground.h"
#include "surrogate/vehicle/trajectory_messages.h"

namespace grouser::cli {
namespace {

using namespace vehicle;

client::Server ServerOf(const VehicleServer& s) { return {s.address, s.access}; }

class ServerAnswers final : public VehicleAnswers {
 public:
  ServerAnswers(const VehicleServer& server, const std::string& name)
      : client_(ServerOf(server), client::Milliseconds(server.deadline_ms)) {
    const v1alpha1::GetVehicleResponse response = Ask(&VehicleClient::GetVehicle, name);
    described_ = FromMessage(response.vehicle());
  }

  void AddMixture(const std::string& text) override {
    const SoilWeights weights = ReadSoilWeights(text);
    vehicle::ToMessage(text, weights, mixtures_.Add());
    described_.soils.push_back(text);
  }
  Solution Solve(const Motion& motion, GoProbability* go) override {
    return SolveToGo(motion, 0, go);
  }
  MotionOnDraws SolveOnDraws(const Motion& motion, std::size_t draws) override {
    MotionOnDraws out;
    SolveToGo(motion, draws, &out.go);
    auto request = RequestFor<v1alpha1::SolveRequest>();
    request.set_draws(static_cast<std::uint32_t>(draws));
    Motion drawn = motion;
    for (std::size_t k = 0; k < draws; ++k) {
      drawn.draw = static_cast<int>(k);
      Append(drawn, described_, request.mutable_motions());
    }
    const v1alpha1::SolveResponse response = Ask(&VehicleClient::Solve, request);
    for (std::size_t k = 0; k < draws; ++k) {
      out.solutions.push_back(SolutionAt(response.solutions(), described_, k));
    }
    return out;
  }
  std::vector<PowerInterval> Energies(std::span<const Motion> motions) override {
    constexpr std::size_t kMotionsOfACall = 500;
    std::vector<PowerInterval> powers;
    while (powers.size() < motions.size()) {
      auto request = RequestFor<v1alpha1::EnergyRequest>();
      const std::size_t count = std::min(kMotionsOfACall, motions.size() - powers.size());
      for (const Motion& motion : motions.subspan(powers.size(), count)) {
        Append(motion, described_, request.mutable_motions());
      }
      const auto response = Ask(&VehicleClient::Energy, request);
      for (std::size_t i = 0; i < count; ++i) {
        powers.push_back(PowerAt(response.powers(), described_, i));
      }
      if (motions.size() > 1) {  // a drive
        const std::size_t first = powers.size() - count;
        AddSpeeds(motions.subspan(first, count), std::span(powers).subspan(first));
      }
    }
    return powers;
  }
  std::vector<TrajectoryCost> Costs(
      std::span<const std::vector<TrajectoryStep>> trajectories) override {
    std::vector<TrajectoryCost> costs;
    while (costs.size() < trajectories.size()) {
      const auto rest = trajectories.subspan(costs.size());
      if (rest.front().size() > kStepsOfACall) {
        costs.push_back(CostOfALongOne(rest.front()));
        continue;
      }
      std::size_t steps = 0, count = 0;
      while (count < rest.size() && steps + rest[count].size() <= kStepsOfACall) {
        steps += rest[count++].size();
      }
      const std::vector<TrajectoryCost> more = CostsByOneCall(rest.first(count));
      costs.insert(costs.end(), more.begin(), more.end());
    }
    return costs;
  }
  std::size_t Plan(std::span<const PathPoint> path, const SpeedOptions& options,
                   std::span<SpeedPoint> out, PlanOnDraws* on_draws) override {
    auto request = RequestFor<v1alpha1::PlanSpeedRequest>();
    ToMessage(path, request.mutable_path());
    client::SetOptions(options, &request);
    request.set_draws(static_cast<std::uint32_t>(on_draws->draws));
    const v1alpha1::PlanSpeedResponse response =
        Ask<v1alpha1::PlanSpeedResponse>(&VehicleClient::PlanSpeed, request);
    FromMessage(response.plan(), out);
    on_draws->holds = response.hold_probability();
    const auto& at = response.point_hold_probability();
    on_draws->at.assign(at.begin(), at.end());
    return response.not_held();
  }
  GradeRange Grades(double speed, std::uint8_t soil, const SpeedOptions& options) override {
    auto request = RequestFor<v1alpha1::GradesRequest>();
    request.set_speed_m_per_s(speed);
    request.add_soils(described_.soils[soil]);
    request.set_worse_by_sd(options.worse_by_sd);
    ToMessage(options, request.mutable_margins());
    const v1alpha1::GradesResponse response = Ask(&VehicleClient::Grades, request);
    if (response.grades().empty()) throw std::runtime_error("the server gave no grades");
    return FromMessage(response.grades(0));
  }
  std::vector<SkidConstants> Constants(std::span<const double> speeds,
                                       std::span<const double> radii,
                                       std::span<const std::uint8_t> soils) override {
    const std::size_t own = described_.soils.size() - static_cast<std::size_t>(mixtures_.size());
    for (const std::uint8_t soil : soils) {
      if (soil < own) continue;
      throw std::invalid_argument(
          "soil " + described_.soils[soil] +
          ": a server answers constants of the soils of its vehicles alone, "
          "expected one of these, or no --server");
    }
    v1alpha1::ConstantsRequest request;
    request.set_vehicle(described_.vehicle.name);
    *request.mutable_speeds_m_per_s() = {speeds.begin(), speeds.end()};
    *request.mutable_radii_m() = {radii.begin(), radii.end()};
    const v1alpha1::ConstantsResponse response = Ask(&VehicleClient::Constants, request);
    std::vector<SkidConstants> constants;
    for (const auto& c : response.constants()) {
      const auto asked = [&](std::uint8_t s) { return described_.soils[s] == c.soil(); };
      if (soils.empty() || std::ranges::any_of(soils, asked)) constants.push_back(FromMessage(c));
    }
    return constants;
  }

 private:
  using VehicleClient = client::VehicleClient;

  /// A twentieth or less of what a server takes, as its limit of time is sooner met on soft soil.
  static constexpr std::size_t kStepsOfACall = 1000;

  /// Of this vehicle with the soils of this call.
  template <class Request>
  Request RequestFor() const {
    Request request;
    request.set_vehicle(described_.vehicle.name);
    *request.mutable_mixtures() = mixtures_;
    return request;
  }

  std::vector<TrajectoryCost> CostsByOneCall(
      std::span<const std::vector<TrajectoryStep>> trajectories) const {
    auto request = RequestFor<v1alpha1::EvaluateTrajectoriesRequest>();
    for (const auto& t : trajectories) Append(t, request.mutable_trajectories());
    Shorten(request.mutable_trajectories());
    const auto response = Ask(&VehicleClient::EvaluateTrajectories, request);
    std::vector<TrajectoryCost> costs;
    for (std::size_t k = 0; k < trajectories.size(); ++k) {
      costs.push_back(CostAt(response.costs(), k));
    }
    return costs;
  }
  /// By several calls, its steps as trajectories of one step each, whose costs add up to the bits
  /// of the whole.
  TrajectoryCost CostOfALongOne(std::span<const TrajectoryStep> steps) const {
    TrajectoryCost sum;
    std::vector<std::vector<TrajectoryStep>> single;
    int at = 0;
    for (; !steps.empty(); steps = steps.subspan(single.size())) {
      single.clear();
      for (const TrajectoryStep& s : steps.first(std::min(kStepsOfACall, steps.size()))) {
        single.push_back({s});
      }
      for (const TrajectoryCost& cost : CostsByOneCall(single)) sum.Add(at++, cost);
    }
    return sum;
  }
  /// Speeds of motions whose power is exactly 0, which powers do not say: the ways in one second.
  void AddSpeeds(std::span<const Motion> motions, std::span<PowerInterval> powers) const {
    std::vector<std::vector<TrajectoryStep>> steps;
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < motions.size(); ++i) {
      if (powers[i].mean.electric != 0 || powers[i].joules_per_metre != 0) continue;
      steps.push_back({{motions[i], 1}});
      rows.push_back(i);
    }
    if (rows.empty()) return;
    const std::vector<TrajectoryCost> costs = CostsByOneCall(steps);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      powers[rows[k]].speed_m_per_s = costs[k].energy.metres;
    }
  }

  Solution SolveToGo(const Motion& motion, std::size_t draws, GoProbability* go) const {
    auto request = RequestFor<v1alpha1::SolveRequest>();
    Append(motion, described_, request.mutable_motions());
    request.set_with_go_probability(true);
    request.set_draws(static_cast<std::uint32_t>(draws));
    request.mutable_margins()->set_tip(0);  // the limits of the vehicle alone
    const v1alpha1::SolveResponse response = Ask(&VehicleClient::Solve, request);
    if (response.go_probability_least().empty() || response.go_probability_most().empty()) {
      throw std::runtime_error("the server gave no probability to go");
    }
    *go = {response.go_probability_least(0), response.go_probability_most(0)};
    return SolutionAt(response.solutions(), described_, 0);
  }

  /// One call. What the server finds wrong with it is bad usage here.
  template <class Response, class Request>
  Response Ask(Response (VehicleClient::*method)(const Request&) const,
               const Request& request) const {
    try {
      return (client_.*method)(request);
    } catch (const client::ClientError& error) {
      if (error.code() != grpc::StatusCode::INVALID_ARGUMENT &&
          error.code() != grpc::StatusCode::FAILED_PRECONDITION &&
          error.code() != grpc::StatusCode::NOT_FOUND) {
        throw;
      }
      throw std::invalid_argument(error.what());
    }
  }

  VehicleClient client_;
  google::protobuf::RepeatedPtrField<v1alpha1::SoilMixture> mixtures_;
};

}  // namespace

std::unique_ptr<VehicleAnswers> AnswersOfServer(const VehicleServer& server,
                                                const std::string& name) {
  return std::make_unique<ServerAnswers>(server, name);
}

std::string ListVehicles(const VehicleServer& server) {
  const client::VehicleClient client(ServerOf(server), client::Milliseconds(server.deadline_ms));
  std::string out;
  const v1alpha1::ListVehiclesResponse response = client.ListVehicles();
  for (const v1alpha1::VehicleInfo& v : response.vehicles()) {
    out += fmt::format("{:16} {:8g} kg  {} wheels  {:8}  {}\n", v.name(), v.mass_kg(), v.wheels(),
                       v.steered() ? "steered" : "", fmt::join(v.soils(), ", "));
  }
  return out;
}

}  // namespace grouser::cli
