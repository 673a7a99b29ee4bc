#pragma once

#include <google/protobuf/repeated_field.h>

#include <optional>

#include "server/vehicle/fleet.h"
#include "server/vehicle/vehicle_bench.h"

namespace grouser::server {

using Mixtures = google::protobuf::RepeatedPtrField<v1alpha1::SoilMixture>;

/// The vehicle of one call: that of the fleet with what a thread keeps for it or, where the call
/// has soils of its own, one with these and with a solver and a planner that go with it.
class CallVehicle {
 public:
  /// `served` and `bench` must outlive it. Throws StatusError INVALID_ARGUMENT "mixtures[I]: ...".
  CallVehicle(const ServedVehicle& served, const Mixtures& mixtures, VehicleBench& bench);
  CallVehicle(const CallVehicle&) = delete;

  const vehicle::VehicleFile& file() const { return vehicle_->file; }
  const vehicle::DescribedVehicle& described() const { return vehicle_->described; }
  vehicle::Solver* solver() const { return bench_->SolverOf(*vehicle_); }
  vehicle::SpeedPlanner* Planner(std::size_t points) const {
    return bench_->PlannerOf(*vehicle_, points);
  }

 private:
  std::optional<ServedVehicle> own_;
  std::optional<VehicleBench> own_bench_;
  const ServedVehicle* vehicle_;
  VehicleBench* bench_;
};

}  // namespace grouser::server
