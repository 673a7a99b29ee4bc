#pragma once

#include <string>
#include <utility>
#include <vector>

#include "surrogate/vehicle/vehicle_file.h"
#include "surrogate/vehicle/yaml.h"

namespace grouser::vehicle {

/// Soils of a file by name, each with how likely it is.
using SoilWeights = std::vector<std::pair<std::string, double>>;

/// Adds a soil of which it is not known which of some others it is: for each wheel type the
/// mixture (surrogate/models/mixture_model.h) of its models of these soils. Returns its index.
/// Throws std::invalid_argument for a name that is there already, a soil that is not or stands
/// there twice, one without a model for a wheel type that has one of another, weights that are
/// negative, not finite or all 0, and over kMostSoils soils.
std::size_t AddMixture(const std::string& soil, const SoilWeights& weights, VehicleFile* file);

/// "{NAME: WEIGHT, ...}", as the command line has it. Throws InputError.
SoilWeights ReadSoilWeights(const std::string& text);

/// The file's key `mixtures`.
void ReadMixtures(yaml::YamlSection* file, VehicleFile* out);

}  // namespace grouser::vehicle
