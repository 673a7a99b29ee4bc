#pragma once

#include <string>

#include "surrogate/vehicle/energy.h"
#include "surrogate/vehicle/speed_plan.h"
#include "surrogate/vehicle/vehicle_file.h"

namespace grouser::vehicle {

/// Grades of one soil.
struct SoilGrades {
  std::string soil;
  GradeRange grades;
};

/// For people, with a line feed at the end.
std::string TextOf(const VehicleFile& file);
std::string TextOf(const VehicleFile& file, const Solution& solution, const GoProbability& go);
std::string TextOf(const VehicleFile& file, const PowerInterval& power);
std::string TextOf(std::span<const PathPoint> path, std::span<const SpeedPoint> plan);
std::string TextOf(std::span<const SoilGrades> soils);
/// For programs; NaN as null.
std::string JsonOf(const VehicleFile& file, const Solution& solution, const GoProbability& go);
std::string JsonOf(const VehicleFile& file, const PowerInterval& power);
std::string JsonOf(std::span<const PathPoint> path, std::span<const SpeedPoint> plan);
std::string JsonOf(std::span<const SoilGrades> soils);

}  // namespace grouser::vehicle
