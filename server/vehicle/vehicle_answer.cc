#include "server/vehicle/vehicle_answer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <span>
#include <vector>

#include "server/vehicle/call_draws.h"
#include "server/vehicle/call_vehicle.h"
#include "server/vehicle/vehicle_check.h"
#include "surrogate/vehicle/message_checks.h"
#include "surrogate/vehicle/solve_all.h"
#include "surrogate/vehicle/stop.h"
#include "surrogate/vehicle/trajectory_messages.h"

namespace grouser::server {
namespace {

using namespace vehicle;

constexpr std::size_t kChunk = 64;  // motions between two looks at whether the call is cancelled

[[noreturn]] void Refuse(const std::string& field, double got, const char* expected) {
  throw StatusError(StatusCode::kInvalidArgument,
                    fmt::format("{}: {}, expected {}", field, got, expected));
}

double PositiveOr(bool has, double value, double otherwise, const char* field) {
  if (!has) return otherwise;
  if (!(value > 0) || !std::isfinite(value)) Refuse(field, value, "a finite number above 0");
  return value;
}
double FiniteOr(bool has, double value, double otherwise, const char* field) {
  if (!has) return otherwise;
  if (!std::isfinite(value)) Refuse(field, value, "a finite number");
  return value;
}
double FromZero(double value, const char* field) {
  if (!(value >= 0) || !std::isfinite(value)) Refuse(field, value, "a finite number from 0 on");
  return value;
}

/// Of the ground to both ends of an interval.
template <class Request>
double SdsOf(const Request& request) {
  return request.has_interval_sds() ? FromZero(request.interval_sds(), "interval_sds")
                                    : SpeedOptions{}.worse_by_sd;
}

template <class Request>
Mixtures MixturesOf(const Request& request) {
  if constexpr (requires { request.mixtures(); }) {
    return request.mixtures();
  } else {
    return {};
  }
}

/// Finds the vehicle, has `fill` make the response within the call's time and says how long that
/// took.
template <class Request, class Response, class Fill>
Status Timed(const VehicleContext& context, const Request& request, Response* response,
             const Fill& fill) {
  return Guarded([&] {
    const auto start = std::chrono::steady_clock::now();
    const ServedVehicle* served = nullptr;
    if (Status status = context.fleet.Find(request.vehicle(), &served); !status.ok()) return status;
    try {
      const StopWhen stop(&context.cancelled, context.limit);
      fill(CallVehicle(*served, MixturesOf(request), context.bench), stop);
    } catch (const OutOfTime&) {
      response->Clear();
      return Status::ResourceExhausted(fmt::format(
          "work: more than {:g} s of processor time, expected less in one call; ask for fewer "
          "motions, steps, points, draws or constants in each of several calls",
          std::chrono::duration<double>(context.limit).count()));
    }
    const std::chrono::nanoseconds spent = std::chrono::steady_clock::now() - start;
    response->mutable_latency()->set_seconds(spent.count() / 1'000'000'000);
    response->mutable_latency()->set_nanos(static_cast<int>(spent.count() % 1'000'000'000));
    return Status::Ok();
  });
}

SpeedOptions MarginsOf(const StopWhen& stop, const v1alpha1::Margins& margins) {
  SpeedOptions options;
  Reading([&] { vehicle::FromMessage(margins, &options); });
  options.stop = stop;
  return options;
}

SpeedOptions OptionsOf(const StopWhen& stop, const v1alpha1::PlanSpeedRequest& r) {
  SpeedOptions o = MarginsOf(stop, r.margins());
  o.speed_limit_m_per_s = PositiveOr(true, r.speed_limit_m_per_s(), 0, "speed_limit_m_per_s");
  o.worse_by_sd = FiniteOr(r.has_worse_by_sd(), r.worse_by_sd(), o.worse_by_sd, "worse_by_sd");
  o.acceleration_m_per_s2 = PositiveOr(r.has_acceleration_m_per_s2(), r.acceleration_m_per_s2(),
                                       o.acceleration_m_per_s2, "acceleration_m_per_s2");
  o.braking_m_per_s2 = PositiveOr(r.has_braking_m_per_s2(), r.braking_m_per_s2(),
                                  o.braking_m_per_s2, "braking_m_per_s2");
  o.start_m_per_s = FromZero(r.start_m_per_s(), "start_m_per_s");
  o.end_m_per_s = FromZero(r.end_m_per_s(), "end_m_per_s");
  return o;
}

std::vector<Motion> MotionsOf(const v1alpha1::Motions& motions, const CallVehicle& v) {
  return Reading([&] { return vehicle::FromMessage(motions, v.described()); });
}

void CheckAbove0(const google::protobuf::RepeatedField<double>& numbers, const char* field) {
  if (numbers.empty()) {
    throw StatusError(StatusCode::kInvalidArgument, fmt::format("{}: none, expected one", field));
  }
  Reading([&] { vehicle::CheckAbove0(field, numbers); });
}

/// Of each trajectory: the shares of the draws on which it goes at all steps.
void AddRisks(const CallVehicle& v, TrajectoryReader* trajectories, std::size_t count,
              const SpeedOptions& options, v1alpha1::EvaluateTrajectoriesResponse* response) {
  CallDraws draws(v, count);
  SpeedPlanner* planner = v.Planner(1);
  draws.For(planner);
  std::vector<std::uint8_t> least(count), most(count);
  std::vector<Motion> motions;
  for (const std::size_t steps : trajectories->steps()) {
    std::fill(least.begin(), least.end(), 1);
    std::fill(most.begin(), most.end(), 1);
    motions.resize(steps);
    for (Motion& motion : motions) motion = trajectories->Next().motion;
    planner->KeepGoing(motions, options, least, most);
    response->add_go_probability_least(ShareOf(least));
    response->add_go_probability_most(ShareOf(most));
  }
}

std::span<const double> SpanOf(const google::protobuf::RepeatedField<double>& numbers) {
  return {numbers.data(), static_cast<std::size_t>(numbers.size())};
}

}  // namespace

Status Answer(const VehicleContext& context, const v1alpha1::SolveRequest& request,
              v1alpha1::SolveResponse* response) {
  return Timed(context, request, response, [&](const CallVehicle& v, const StopWhen& stop) {
    const SpeedOptions options = MarginsOf(stop, request.margins());
    const std::vector<Motion> motions = MotionsOf(request.motions(), v);
    std::array<Solution, kChunk> solutions;
    CallDraws draws(v, request.draws());
    Solver* solver = v.solver();
    draws.For(solver);
    for (std::size_t first = 0; first < motions.size(); first += kChunk) {
      const std::size_t count = std::min(kChunk, motions.size() - first);
      vehicle::SolveAll(solver, std::span(motions).subspan(first, count),
                        std::span(solutions).first(count), stop);
      for (std::size_t k = 0; k < count; ++k) {
        Append(solutions[k], v.described(), response->mutable_solutions());
      }
    }
    if (!request.with_go_probability()) return;
    SpeedPlanner* planner = v.Planner(1);
    draws.For(planner);
    for (const Motion& motion : motions) {
      const GoProbability go = draws ? planner->ProbabilityByDraws(motion, options)
                                     : planner->ProbabilityToGo(motion, options);
      response->add_go_probability_least(go.least);
      response->add_go_probability_most(go.most);
    }
  });
}

Status Answer(const VehicleContext& context, const v1alpha1::EnergyRequest& request,
              v1alpha1::EnergyResponse* response) {
  return Timed(context, request, response, [&](const CallVehicle& v, const StopWhen& stop) {
    const double sds = SdsOf(request);
    const std::vector<Motion> motions = MotionsOf(request.motions(), v);
    PowerBatch batch(v.solver(), motions.size());
    auto next = motions.begin();
    batch.ForEach(
        motions.size(), sds, stop, [&] { return *next++; },
        [&](const PowerInterval& power) {
          Append(power, v.described(), response->mutable_powers());
        });
  });
}

Status Answer(const VehicleContext& context, const v1alpha1::EvaluateTrajectoriesRequest& request,
              v1alpha1::EvaluateTrajectoriesResponse* response) {
  return Timed(context, request, response, [&](const CallVehicle& v, const StopWhen& stop) {
    const double sds = SdsOf(request);
    const double worse_by_sd = FiniteOr(true, request.worse_by_sd(), 0, "worse_by_sd");
    const SpeedOptions options = MarginsOf(stop, request.margins());
    TrajectoryReader reader = Reading(
        [&] { return TrajectoryReader(request.trajectories(), v.described(), worse_by_sd); });
    TrajectoryReader again = reader;
    TrajectoryEvaluator::Tell tell;
    if (request.with_steps()) {
      tell = [&](const PowerInterval& power) { Append(power, response->mutable_steps()); };
    }
    TrajectoryEvaluator evaluator(v.solver());
    for (const TrajectoryCost& cost : evaluator.CostsOf(
             reader.steps(), [&] { return reader.Next(); }, sds, stop, tell)) {
      Append(cost, response->mutable_costs());
    }
    if (request.draws() > 0) AddRisks(v, &again, request.draws(), options, response);
  });
}

Status Answer(const VehicleContext& context, const v1alpha1::PlanSpeedRequest& request,
              v1alpha1::PlanSpeedResponse* response) {
  return Timed(context, request, response, [&](const CallVehicle& v, const StopWhen& stop) {
    const SpeedOptions options = OptionsOf(stop, request);
    const std::vector<PathPoint> path =
        Reading([&] { return vehicle::FromMessage(request.path(), v.described()); });
    std::vector<SpeedPoint> plan(path.size());
    CallDraws draws(v, request.draws());
    SpeedPlanner* planner = v.Planner(path.size());
    draws.For(planner);
    const std::size_t not_held = planner->Plan(path, options, plan);
    vehicle::ToMessage(plan, response->mutable_plan());
    response->set_not_held(static_cast<std::uint32_t>(not_held));
    if (!draws) return;
    std::vector<double> holds(path.size());
    response->set_hold_probability(planner->PlanByDraws(path, options, plan, holds));
    *response->mutable_point_hold_probability() = {holds.begin(), holds.end()};
  });
}

Status Answer(const VehicleContext& context, const v1alpha1::GradesRequest& request,
              v1alpha1::GradesResponse* response) {
  return Timed(context, request, response, [&](const CallVehicle& v, const StopWhen& stop) {
    SpeedOptions options = MarginsOf(stop, request.margins());
    options.worse_by_sd = FiniteOr(request.has_worse_by_sd(), request.worse_by_sd(),
                                   options.worse_by_sd, "worse_by_sd");
    const double speed = FiniteOr(true, request.speed_m_per_s(), 0, "speed_m_per_s");
    std::vector<std::uint8_t> soils;
    for (int i = 0; i < request.soils_size(); ++i) {
      soils.push_back(Reading([&] {
        return SoilIndexOf(fmt::format("soils[{}]", i), request.soils(i), v.described().soils);
      }));
    }
    for (std::size_t s = 0; request.soils().empty() && s < v.described().soils.size(); ++s) {
      soils.push_back(static_cast<std::uint8_t>(s));
    }
    SpeedPlanner* planner = v.Planner(1);
    for (const std::uint8_t soil : soils) {
      vehicle::ToMessage(v.described().soils[soil], planner->Grades(speed, soil, options),
                         response->add_grades());
    }
  });
}

Status Answer(const VehicleContext& context, const v1alpha1::ConstantsRequest& request,
              v1alpha1::ConstantsResponse* response) {
  return Timed(context, request, response, [&](const CallVehicle& v, const StopWhen& stop) {
    if (v.file().vehicle.steered()) {
      throw StatusError(StatusCode::kFailedPrecondition,
                        "vehicle: steered wheels, expected a skid-steered vehicle");
    }
    CheckAbove0(request.speeds_m_per_s(), "speeds_m_per_s");
    CheckAbove0(request.radii_m(), "radii_m");
    for (const SkidConstants& c :
         ConstantsOf(v.file().vehicle, v.file().grounds, SpanOf(request.speeds_m_per_s()),
                     SpanOf(request.radii_m()), stop)) {
      vehicle::ToMessage(c, response->add_constants());
    }
  });
}

}  // namespace grouser::server
