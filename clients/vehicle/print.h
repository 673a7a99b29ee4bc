#pragma once

#include <string>

#include "clients/vehicle/answers.h"
#include "clients/vehicle/motion_log.h"
#include "surrogate/vehicle/energy.h"
#include "surrogate/vehicle/messages.h"
#include "surrogate/vehicle/speed_plan.h"
#include "surrogate/vehicle/trajectory.h"

namespace grouser::cli {

using vehicle::DescribedVehicle, vehicle::GoProbability, vehicle::GradeRange, vehicle::PathPoint,
    vehicle::PowerInterval, vehicle::Solution, vehicle::SpeedPoint, vehicle::TrajectoryCost,
    vehicle::Vehicle;

/// Grades of one soil.
struct SoilGrades {
  std::string soil;
  GradeRange grades;
};

/// For people, with a line feed at the end.
std::string TextOf(const DescribedVehicle& described);
/// `on_draws`: also quantiles over draws; without solutions: there are none.
std::string TextOf(const Vehicle& v, const Solution& solution, const GoProbability& go,
                   const MotionOnDraws& on_draws);
std::string TextOf(const Vehicle& v, const PowerInterval& power);
std::string TextOf(std::span<const PathPoint> path, std::span<const SpeedPoint> plan,
                   const PlanOnDraws& on_draws);
std::string TextOf(std::span<const SoilGrades> soils);
/// A line a row: time_s if there are times, then the parts of the power [W] and J/m. "nan" where
/// nothing balances.
std::string CsvOf(const MotionLog& log, std::span<const PowerInterval> powers);
/// Energy of the drive and how many rows are not in it; without times only how many rows do not
/// balance.
std::string SumOf(const MotionLog& log, std::span<const PowerInterval> powers);
/// For programs; NaN as null.
std::string JsonOf(const Vehicle& v, const Solution& solution, const GoProbability& go,
                   const MotionOnDraws& on_draws);
std::string JsonOf(const Vehicle& v, const PowerInterval& power);
/// {"rows": [...]} as of single motions; of a drive with times also "joules", its ends, "seconds",
/// "metres".
std::string JsonOf(const Vehicle& v, const MotionLog& log, std::span<const PowerInterval> powers);
/// Of drives, by name: a line each, with rows counted from 0.
std::string CsvOf(std::span<const std::string> drives, std::span<const TrajectoryCost> costs);
std::string JsonOf(std::span<const std::string> drives, std::span<const TrajectoryCost> costs);
std::string JsonOf(std::span<const PathPoint> path, std::span<const SpeedPoint> plan,
                   const PlanOnDraws& on_draws);
std::string JsonOf(std::span<const SoilGrades> soils);

}  // namespace grouser::cli
