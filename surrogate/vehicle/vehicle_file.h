#pragma once

#include <memory>
#include <string>
#include <vector>

#include "surrogate/vehicle/solver.h"

namespace grouser::vehicle {

/// A vehicle file as read: the vehicle, and a model for each wheel type and soil that it names.
struct VehicleFile {
  Vehicle vehicle;
  Grounds grounds;  ///< points into `models`
  std::vector<std::unique_ptr<const surrogate::WheelModel>> models;
  std::vector<std::string> sources;  ///< "SOIL: WHEEL: what answers", for people
};

/// Reads a vehicle file (YAML; docs/planning.md, vehicle.schema.json). Model files are named from
/// its folder. Throws InputError "FILE:LINE: key 'a.b': got X, expected Y" for what is wrong in
/// the file, for a model that cannot be read, whose radius or width is not the wheel's (by over
/// 1 %), and for models of different gravity.
VehicleFile ReadVehicle(const std::string& file);

/// The JSON schema of the file.
std::string VehicleSchema();

}  // namespace grouser::vehicle
