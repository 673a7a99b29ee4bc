#include "surrogate/measured_vehicles/terrains.h"

#include <fstream>
#include <stdexcept>

#include "surrogate/soils/soil_library.h"

namespace grouser::measured {

const std::vector<Terrain>& Terrains() {
  static const std::vector<Terrain> terrains = {{"ASPHALT", "asphalt", "", 0.20, 0.05},
                                                {"FLOORING", "floor", "", 0.20, 0.05},
                                                {"ICE", "ice", "", 0.20, 0.05},
                                                {"SANDY_LOAM", "", "sandy loam", 0.15, 0.08},
                                                {"SNOW", "", "snow", 0.30, 0.08}};
  return terrains;
}

const Terrain& TerrainOf(const std::string& name) {
  for (const Terrain& t : Terrains()) {
    if (t.name == name) return t;
  }
  throw std::invalid_argument("terrain: got " + name +
                              ", expected ASPHALT, FLOORING, ICE, SANDY_LOAM or SNOW");
}

PublishedGrounds Published() {
  const std::string path = surrogate::PublishedSoilsFile();
  std::ifstream soils(path);
  if (!soils) throw std::invalid_argument(path + ": cannot be read, expected a table");
  return {surrogate::PublishedHardGrounds(), surrogate::ReadSoils(soils, path)};
}

PublishedGrounds SuggestedOf(const PublishedGrounds& all) {
  surrogate::SoilLibrary library;
  library.Add(surrogate::PublishedSoilsFile());
  PublishedGrounds suggested{all.hard, {}};
  for (const Terrain& terrain : Terrains()) {
    if (terrain.soils.empty()) continue;
    suggested.soils.push_back(SuggestSoils(library, terrain.soils, {}).at(0).entry->soil);
  }
  return suggested;
}

Candidates CandidatesOf(const Terrain& terrain, const vehicle::Vehicle& vehicle,
                        const PublishedGrounds& all, Wheels wheels) {
  Candidates found{{}, 0, terrain.hard};
  if (!terrain.hard.empty()) {
    found.grounds.emplace_back(vehicle, FindHardGround(all.hard, terrain.hard).ground);
    return found;
  }
  std::string name;
  for (const surrogate::Soil& soil : all.soils) {
    // "sandy loam" stands in "Sandy loam 15 %" and in "Upland sandy loam 51 %".
    if (soil.name.find(terrain.soils.substr(1)) == std::string::npos) continue;
    name = soil.name;
    found.grounds.emplace_back(vehicle, soil, wheels);
  }
  if (found.grounds.empty())
    throw std::invalid_argument("no published soil '" + terrain.soils + "'");
  found.tyre_rolling = FindHardGround(all.hard, "asphalt").ground.rolling_resistance;
  found.said = found.grounds.size() == 1
                   ? name
                   : "median of " + std::to_string(found.grounds.size()) + " soils";
  return found;
}

}  // namespace grouser::measured
