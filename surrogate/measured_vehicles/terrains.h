#pragma once

#include <string>
#include <vector>

#include "surrogate/measured_vehicles/grounds.h"

namespace grouser::measured {

/// What is published of the grounds that were driven on, none of it fitted.
struct PublishedGrounds {
  std::vector<surrogate::PublishedHardGround> hard;
  std::vector<surrogate::Soil> soils;
};

/// All of the shipped tables.
PublishedGrounds Published();
/// Of the soils of each terrain only the first that `grouser soil suggest` names for its words.
PublishedGrounds SuggestedOf(const PublishedGrounds& all);

/// The grounds that may stand for a terrain: one of the hard ones, or all published soils of that
/// kind, as nobody says which it was; the prediction is their median.
struct Terrain {
  std::string name;   ///< of the rows
  std::string hard;   ///< of PublishedGrounds, or empty
  std::string soils;  ///< words in the names of its soils
  double power_target, yaw_target;
};
/// ASPHALT, FLOORING, ICE, SANDY_LOAM, SNOW; ploughed soil counts as sandy loam.
const std::vector<Terrain>& Terrains();

/// By its name. Throws std::invalid_argument "terrain: got X, expected ...".
const Terrain& TerrainOf(const std::string& name);

/// The grounds that stand for a terrain, and the tyre's own rolling resistance that they leave out.
struct Candidates {
  std::vector<OnGround> grounds;
  double tyre_rolling;
  std::string said;
};
Candidates CandidatesOf(const Terrain& terrain, const vehicle::Vehicle& vehicle,
                        const PublishedGrounds& all, Wheels wheels);

}  // namespace grouser::measured
