#pragma once

#include <atomic>
#include <chrono>

#include "grouser/v1alpha1/vehicle_service.pb.h"
#include "server/core/status.h"
#include "server/vehicle/fleet.h"
#include "server/vehicle/vehicle_bench.h"

namespace grouser::server {

/// Processor time of a thread that one call may take.
inline constexpr std::chrono::seconds kMostCallTime{5};

/// Who answers, and when to give up.
struct VehicleContext {
  const Fleet& fleet;
  VehicleBench& bench;
  const std::atomic<bool>& cancelled;  ///< asked at every round of solves; set: no answer
  std::chrono::nanoseconds limit = kMostCallTime;  ///< of this call; asked for as often
};

// One request each that Check lets pass; its entries are looked at before anything is solved. A
// call that is cancelled ends with UNAVAILABLE, one that takes too much time with
// RESOURCE_EXHAUSTED. Nothing is thrown: what fails here, e.g. for want of memory, is INTERNAL.
Status Answer(const VehicleContext& context, const v1alpha1::SolveRequest& request,
              v1alpha1::SolveResponse* response);
Status Answer(const VehicleContext& context, const v1alpha1::EnergyRequest& request,
              v1alpha1::EnergyResponse* response);
Status Answer(const VehicleContext& context, const v1alpha1::EvaluateTrajectoriesRequest& request,
              v1alpha1::EvaluateTrajectoriesResponse* response);
Status Answer(const VehicleContext& context, const v1alpha1::PlanSpeedRequest& request,
              v1alpha1::PlanSpeedResponse* response);
Status Answer(const VehicleContext& context, const v1alpha1::GradesRequest& request,
              v1alpha1::GradesResponse* response);
Status Answer(const VehicleContext& context, const v1alpha1::ConstantsRequest& request,
              v1alpha1::ConstantsResponse* response);

}  // namespace grouser::server
