#pragma once

#include <stdexcept>

#include "grouser/v1alpha1/vehicle_service.pb.h"
#include "server/core/status.h"
#include "server/vehicle/fleet.h"

namespace grouser::server {

/// Most of one call, so that answers stay below 4 MB and work is bounded. A motion whose
/// probability to go is asked for counts as kSolvesToGo, with draws as one a draw; draws count
/// times the vehicle's soils and the mixtures (6 KiB each) and times the points of a plan
/// or the steps of trajectories (kMaxDrawnPoints); trajectories with numbers of each step and draws
/// take at most kMaxAnswerBytes; constants count pairs of speed and radius times
/// soils, and a request takes so much memory at most while it waits.
inline constexpr std::size_t kMaxMotions = 3000, kSolvesToGo = 25, kMaxPathPoints = 10000,
                             kMaxTrajectorySteps = 30000, kMaxDraws = 1024,
                             kMaxDrawnPoints = 100000, kMaxConstants = 1000, kMaxSoilNames = 255,
                             kMaxMixtures = 8, kMaxMixtureSoils = 64, kMaxRequestBytes = 2 << 20,
                             kMaxAnswerBytes = (4 << 20) - 1024;

// Whether a request may wait for a thread: the vehicle is there, all its arrays have lengths that
// fit each other and are not too many. Looks at no entry but the numbers of trajectories' steps.
Status Check(const Fleet& fleet, const v1alpha1::SolveRequest& request);
Status Check(const Fleet& fleet, const v1alpha1::EnergyRequest& request);
Status Check(const Fleet& fleet, const v1alpha1::EvaluateTrajectoriesRequest& request);
Status Check(const Fleet& fleet, const v1alpha1::PlanSpeedRequest& request);
Status Check(const Fleet& fleet, const v1alpha1::GradesRequest& request);
Status Check(const Fleet& fleet, const v1alpha1::ConstantsRequest& request);

/// What the answer to a checked request may take at most, where that does not follow from the
/// request's own bytes: trajectories are counted, their arrays are not needed. Of others 0.
std::size_t MostAnswerBytes(const v1alpha1::EvaluateTrajectoriesRequest& request);
template <class Request>
std::size_t MostAnswerBytes(const Request& /*request*/) {
  return 0;
}

/// Of the exception that is being handled: a StatusError is its status, Stopped UNAVAILABLE, all
/// else a fault of this program, which is logged: INTERNAL.
Status StatusOfException();

/// What `work` returns, or the status of what it throws.
template <class Work>
Status Guarded(const Work& work) {
  try {
    return work();
  } catch (...) {
    return StatusOfException();
  }
}

/// Runs what reads a message: its std::invalid_argument is the client's fault, INVALID_ARGUMENT.
template <class Read>
auto Reading(const Read& read) {
  try {
    return read();
  } catch (const std::invalid_argument& error) {
    throw StatusError(StatusCode::kInvalidArgument, error.what());
  }
}

}  // namespace grouser::server
