#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "grouser/v1alpha1/vehicle.pb.h"
#include "surrogate/vehicle/constants.h"
#include "surrogate/vehicle/energy.h"
#include "surrogate/vehicle/speed_plan.h"

/// Vehicles, motions, answers and plans to messages and back, bit for bit: one place for servers
/// and clients.
namespace grouser::vehicle {

/// A vehicle and the names that come with it.
struct DescribedVehicle {
  Vehicle vehicle;
  std::vector<std::string> soils;    ///< what indices of soils count
  std::vector<std::string> sources;  ///< "SOIL: WHEEL: what answers", for people
};

void ToMessage(const DescribedVehicle& from, v1alpha1::Vehicle* to);
/// Of a message that ToMessage made; throws std::invalid_argument as Check for others.
DescribedVehicle FromMessage(const v1alpha1::Vehicle& from);

/// How many motions; without a check.
std::size_t CountOf(const v1alpha1::Motions& from, const DescribedVehicle& vehicle);
/// Lengths of all arrays by each other, no entry: what the readers below throw of them, earlier.
void CheckSizes(const v1alpha1::Motions& from, const DescribedVehicle& vehicle);
void CheckSizes(const v1alpha1::Path& from);
/// All motions of a message. Throws std::invalid_argument "motions.FIELD: 3 entries, expected 4 or
/// none", "motions.soil[2]: 9, expected ...". Numbers that are not finite are left to the solve.
std::vector<Motion> FromMessage(const v1alpha1::Motions& from, const DescribedVehicle& vehicle);
/// Appends a motion; all of one message must be given alike.
void Append(const Motion& motion, const DescribedVehicle& vehicle, v1alpha1::Motions* to);

void Append(const Solution& solution, const DescribedVehicle& vehicle, v1alpha1::Solutions* to);
void Append(const PowerInterval& power, const DescribedVehicle& vehicle, v1alpha1::Powers* to);
/// Entry i. Throws std::invalid_argument where an array is too short. A power of exactly 0 says no
/// speed, which is 0 then.
Solution SolutionAt(const v1alpha1::Solutions& from, const DescribedVehicle& vehicle,
                    std::size_t i);
PowerInterval PowerAt(const v1alpha1::Powers& from, const DescribedVehicle& vehicle, std::size_t i);

/// All points of a path of two or more. Throws std::invalid_argument "path.s_m[3]: ...": sizes,
/// numbers that are not finite, ways that do not ascend, soils that are none.
std::vector<PathPoint> FromMessage(const v1alpha1::Path& from, const DescribedVehicle& vehicle);
void ToMessage(std::span<const PathPoint> from, v1alpha1::Path* to);
void ToMessage(std::span<const SpeedPoint> from, v1alpha1::SpeedPlan* to);
/// Throws std::invalid_argument where the arrays have other lengths.
void FromMessage(const v1alpha1::SpeedPlan& from, std::span<SpeedPoint> to);

/// SoilWeights of mixture_ground.h, which reads files as well.
using NamedWeights = std::vector<std::pair<std::string, double>>;
void ToMessage(const std::string& soil, const NamedWeights& from, v1alpha1::SoilMixture* to);
/// Throws std::invalid_argument "FIELD.weight: 1 entries, expected 2".
NamedWeights FromMessage(const std::string& field, const v1alpha1::SoilMixture& from);

/// Puts margins into options that have defaults.
void FromMessage(const v1alpha1::Margins& from, SpeedOptions* to);
void ToMessage(const SpeedOptions& from, v1alpha1::Margins* to);

void ToMessage(const std::string& soil, const GradeRange& from, v1alpha1::SoilGrades* to);
GradeRange FromMessage(const v1alpha1::SoilGrades& from);
void ToMessage(const SkidConstants& from, v1alpha1::SkidConstants* to);
SkidConstants FromMessage(const v1alpha1::SkidConstants& from);

/// Index of a soil by name. Throws std::invalid_argument "FIELD: got X, expected one of ...".
std::uint8_t SoilIndexOf(const std::string& field, const std::string& name,
                         const std::vector<std::string>& soils);

}  // namespace grouser::vehicle
