#include "server/vehicle/vehicle_bench.h"

#include <algorithm>
#include <bit>

namespace grouser::server {
namespace {

// Points of planners that are kept (3 KB each, for every vehicle and thread).
constexpr std::size_t kKeptPoints = 2048;

}  // namespace

vehicle::Solver* VehicleBench::SolverOf(const ServedVehicle& v) {
  Place& place = places_[v.index];
  if (!place.solver) {
    place.solver = std::make_unique<vehicle::Solver>(v.file.vehicle, v.file.grounds);
  }
  return place.solver.get();
}

vehicle::SpeedPlanner* VehicleBench::PlannerOf(const ServedVehicle& v, std::size_t points) {
  const auto make = [&v](std::size_t room) {
    return std::make_unique<vehicle::SpeedPlanner>(v.file.vehicle, v.file.grounds, room);
  };
  big_.reset();
  if (points > kKeptPoints) return (big_ = make(points)).get();
  Place& place = places_[v.index];
  if (!place.planner || place.points < points) {
    const std::size_t room = std::bit_ceil(std::max<std::size_t>(points, 1));
    place.planner = make(room);  // may throw: what is there stays
    place.points = room;
  }
  return place.planner.get();
}

}  // namespace grouser::server
