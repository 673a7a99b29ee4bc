#include "server/vehicle/vehicle_check.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <string>

#include "surrogate/vehicle/messages.h"
#include "surrogate/vehicle/stop.h"
#include "surrogate/vehicle/trajectory_messages.h"

namespace grouser::server {
namespace {

void AtMost(const std::string& field, std::size_t count, std::size_t most, const char* of = "") {
  if (count <= most) return;
  throw StatusError(Status::ResourceExhausted(
      fmt::format("{}: {} entries{}, at most {} in one message", field, count, of, most)));
}

/// How many soils a call may name: those of the vehicle and its own mixtures.
template <class Request>
std::size_t SoilsOf(const Request& request, const ServedVehicle& v) {
  return v.described.soils.size() + static_cast<std::size_t>(request.mixtures_size());
}

template <class Request>
void CheckMixtures(const Request& request) {
  AtMost("mixtures", static_cast<std::size_t>(request.mixtures_size()), kMaxMixtures);
  std::size_t soils = 0;
  for (const auto& mixture : request.mixtures())
    soils += static_cast<std::size_t>(mixture.of_size());
  AtMost("mixtures.of", soils, kMaxMixtureSoils, " in all");
}

template <class Request>
void CheckDraws(const Request& request, const ServedVehicle& v) {
  AtMost("draws", request.draws(), kMaxDraws);
  AtMost("draws times soils", request.draws() * SoilsOf(request, v), kMaxDraws);
}

void CheckMotions(const v1alpha1::Motions& motions, const ServedVehicle& v, std::size_t most,
                  const char* of = "") {
  AtMost("motions", vehicle::CountOf(motions, v.described), most, of);
  AtMost("motions.soils", static_cast<std::size_t>(motions.soils_size()), kMaxSoilNames);
  vehicle::CheckSizes(motions, v.described);
}

/// `sizes(vehicle)` throws where an array does not fit.
template <class Request, class Sizes>
Status Checked(const Fleet& fleet, const Request& request, const Sizes& sizes) {
  return Guarded([&] {
    const ServedVehicle* served = nullptr;
    if (Status status = fleet.Find(request.vehicle(), &served); !status.ok()) return status;
    Reading([&] { sizes(*served); });
    // What is left: fields that this program does not know.
    if (const std::size_t bytes = request.SpaceUsedLong(); bytes > kMaxRequestBytes) {
      return Status::ResourceExhausted(fmt::format(
          "request: {} bytes of memory, at most {} in one message", bytes, kMaxRequestBytes));
    }
    return Status::Ok();
  });
}

}  // namespace

Status StatusOfException() {
  try {
    throw;
  } catch (const StatusError& error) {
    return error.status();
  } catch (const vehicle::Stopped&) {
    return {StatusCode::kUnavailable, "cancelled"};
  } catch (const std::exception& error) {
    spdlog::error("vehicle: a call failed: {}", error.what());
    return {StatusCode::kInternal, "the server failed to answer; its log says why"};
  }
}

Status Check(const Fleet& fleet, const v1alpha1::SolveRequest& request) {
  return Checked(fleet, request, [&](const ServedVehicle& v) {
    const bool go = request.with_go_probability();
    const std::size_t draws = request.draws();
    CheckMixtures(request);
    CheckDraws(request, v);
    CheckMotions(request.motions(), v,
                 go ? kMaxMotions / (draws > 0 ? draws : kSolvesToGo) : kMaxMotions,
                 go ? " with go_probability" : "");
  });
}

Status Check(const Fleet& fleet, const v1alpha1::EnergyRequest& request) {
  return Checked(fleet, request, [&](const ServedVehicle& v) {
    CheckMixtures(request);
    CheckMotions(request.motions(), v, kMaxMotions);
  });
}

Status Check(const Fleet& fleet, const v1alpha1::EvaluateTrajectoriesRequest& request) {
  return Checked(fleet, request, [&](const ServedVehicle& v) {
    const v1alpha1::Trajectories& trajectories = request.trajectories();
    CheckMixtures(request);
    CheckDraws(request, v);
    AtMost("trajectories.steps", static_cast<std::size_t>(trajectories.steps_size()),
           kMaxTrajectorySteps);
    const std::size_t steps = vehicle::CountOf(trajectories).steps;
    AtMost("steps of all trajectories", steps, kMaxTrajectorySteps);
    AtMost("draws times steps", request.draws() * steps, kMaxDrawnPoints);
    AtMost("trajectories.soils", static_cast<std::size_t>(trajectories.soils_size()),
           kMaxSoilNames);
    vehicle::CheckSizes(trajectories);
    if (const std::size_t bytes = MostAnswerBytes(request); bytes > kMaxAnswerBytes) {
      throw StatusError(Status::ResourceExhausted(
          fmt::format("with_steps and draws: an answer of up to {} bytes, at most {} in one "
                      "message; ask for fewer trajectories or steps, or leave one of the two out",
                      bytes, kMaxAnswerBytes)));
    }
  });
}
std::size_t MostAnswerBytes(const v1alpha1::EvaluateTrajectoriesRequest& request) {
  // Doubles, and numbers of at most kMaxTrajectorySteps (three bytes; with a sign the same) and
  // bits of reasons (two).
  constexpr std::size_t kCost = 8 * 8 + 3 * 3 + 3 * 2, kDraws = 2 * 8, kStep = 7 * 8 + 2;
  static_assert(vehicle::kBadInput < 1 << 14 && 2 * kMaxTrajectorySteps < 1 << 21);
  const vehicle::TrajectoryCounts count = vehicle::CountOf(request.trajectories());
  return count.trajectories * (kCost + (request.draws() > 0 ? kDraws : 0)) +
         (request.with_steps() ? count.steps * kStep : 0);
}

Status Check(const Fleet& fleet, const v1alpha1::PlanSpeedRequest& request) {
  return Checked(fleet, request, [&](const ServedVehicle& v) {
    const v1alpha1::Path& path = request.path();
    const auto points = static_cast<std::size_t>(path.s_m_size());
    AtMost("path.s_m", points, kMaxPathPoints);
    CheckMixtures(request);
    CheckDraws(request, v);
    AtMost("draws times points", request.draws() * points, kMaxDrawnPoints);
    AtMost("path.soils", static_cast<std::size_t>(path.soils_size()), kMaxSoilNames);
    vehicle::CheckSizes(path);
  });
}

Status Check(const Fleet& fleet, const v1alpha1::GradesRequest& request) {
  return Checked(fleet, request, [&](const ServedVehicle& v) {
    CheckMixtures(request);
    AtMost("soils", static_cast<std::size_t>(request.soils_size()), SoilsOf(request, v));
  });
}

Status Check(const Fleet& fleet, const v1alpha1::ConstantsRequest& request) {
  return Checked(fleet, request, [&](const ServedVehicle& v) {
    const auto speeds = static_cast<std::size_t>(request.speeds_m_per_s_size());
    const auto radii = static_cast<std::size_t>(request.radii_m_size());
    AtMost("speeds_m_per_s", speeds, kMaxConstants);
    AtMost("radii_m", radii, kMaxConstants);
    AtMost("speeds times radii times soils", speeds * radii * v.described.soils.size(),
           kMaxConstants);
  });
}

}  // namespace grouser::server
