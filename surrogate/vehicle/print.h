#pragma once

#include <string>

#include "surrogate/vehicle/vehicle_file.h"

namespace grouser::vehicle {

/// For people, with a line feed at the end.
std::string TextOf(const VehicleFile& file);
std::string TextOf(const VehicleFile& file, const Solution& solution);
/// For programs; NaN as null.
std::string JsonOf(const VehicleFile& file, const Solution& solution);

}  // namespace grouser::vehicle
