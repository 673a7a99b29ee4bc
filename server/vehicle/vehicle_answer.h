#pragma once

#include <functional>

#include "grouser/v1alpha1/vehicle_service.pb.h"
#include "server/core/status.h"
#include "server/vehicle/fleet.h"
#include "server/vehicle/vehicle_bench.h"

namespace grouser::server {

/// Most of one call: answers stay below 4 MB, and the work of a call below some seconds.
inline constexpr std::size_t kMaxMotions = 3000, kMaxPathPoints = 10000, kMaxConstants = 1000;

/// Who answers, and when to give up.
struct VehicleContext {
  const Fleet& fleet;
  VehicleBench& bench;
  const std::function<bool()>& cancelled;  ///< asked now and then; true: drop the answer
};

// One request each; requests are looked at in full before anything is solved.
Status Answer(const VehicleContext& context, const v1alpha1::SolveRequest& request,
              v1alpha1::SolveResponse* response);
Status Answer(const VehicleContext& context, const v1alpha1::EnergyRequest& request,
              v1alpha1::EnergyResponse* response);
Status Answer(const VehicleContext& context, const v1alpha1::PlanSpeedRequest& request,
              v1alpha1::PlanSpeedResponse* response);
Status Answer(const VehicleContext& context, const v1alpha1::GradesRequest& request,
              v1alpha1::GradesResponse* response);
Status Answer(const VehicleContext& context, const v1alpha1::ConstantsRequest& request,
              v1alpha1::ConstantsResponse* response);

}  // namespace grouser::server
