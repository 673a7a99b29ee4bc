#pragma once

#include <memory>
#include <vector>

#include "server/vehicle/fleet.h"
#include "surrogate/vehicle/speed_plan.h"

namespace grouser::server {

/// What one thread needs to answer for the vehicles of a fleet: solvers and planners, made when
/// they are first asked for and kept.
class VehicleBench {
 public:
  explicit VehicleBench(const Fleet& fleet) : VehicleBench(fleet.vehicles().size()) {}
  /// For vehicles of so many indices.
  explicit VehicleBench(std::size_t vehicles) : places_(vehicles) {}

  vehicle::Solver* SolverOf(const ServedVehicle& vehicle);
  /// With room for `points`. Room for many is given back when another planner is asked for.
  vehicle::SpeedPlanner* PlannerOf(const ServedVehicle& vehicle, std::size_t points);

 private:
  struct Place {
    std::unique_ptr<vehicle::Solver> solver;
    std::unique_ptr<vehicle::SpeedPlanner> planner;
    std::size_t points = 0;
  };

  std::vector<Place> places_;
  std::unique_ptr<vehicle::SpeedPlanner> big_;
};

}  // namespace grouser::server
