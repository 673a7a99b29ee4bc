#pragma once

#include <string>

#include "surrogate/vehicle/energy.h"
#include "surrogate/vehicle/speed_plan.h"
#include "surrogate/vehicle/vehicle_file.h"

namespace grouser::vehicle {

/// For people, with a line feed at the end.
std::string TextOf(const VehicleFile& file);
std::string TextOf(const VehicleFile& file, const Solution& solution);
std::string TextOf(const VehicleFile& file, const PowerInterval& power);
std::string TextOf(std::span<const PathPoint> path, std::span<const SpeedPoint> plan);
/// For programs; NaN as null.
std::string JsonOf(const VehicleFile& file, const Solution& solution);
std::string JsonOf(const VehicleFile& file, const PowerInterval& power);
std::string JsonOf(std::span<const PathPoint> path, std::span<const SpeedPoint> plan);

}  // namespace grouser::vehicle
