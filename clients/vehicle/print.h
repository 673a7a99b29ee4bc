#pragma once

#include <string>

#include "surrogate/vehicle/energy.h"
#include "surrogate/vehicle/messages.h"
#include "surrogate/vehicle/speed_plan.h"

namespace grouser::cli {

using vehicle::DescribedVehicle, vehicle::GoProbability, vehicle::GradeRange, vehicle::PathPoint,
    vehicle::PowerInterval, vehicle::Solution, vehicle::SpeedPoint, vehicle::Vehicle;

/// Grades of one soil.
struct SoilGrades {
  std::string soil;
  GradeRange grades;
};

/// For people, with a line feed at the end.
std::string TextOf(const DescribedVehicle& described);
std::string TextOf(const Vehicle& v, const Solution& solution, const GoProbability& go);
std::string TextOf(const Vehicle& v, const PowerInterval& power);
std::string TextOf(std::span<const PathPoint> path, std::span<const SpeedPoint> plan);
std::string TextOf(std::span<const SoilGrades> soils);
/// For programs; NaN as null.
std::string JsonOf(const Vehicle& v, const Solution& solution, const GoProbability& go);
std::string JsonOf(const Vehicle& v, const PowerInterval& power);
std::string JsonOf(std::span<const PathPoint> path, std::span<const SpeedPoint> plan);
std::string JsonOf(std::span<const SoilGrades> soils);

}  // namespace grouser::cli
