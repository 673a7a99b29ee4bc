#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "surrogate/terrain_map/build_table.h"
#include "surrogate/terrain_map/cells.h"
#include "surrogate/terrain_map/progress.h"
#include "surrogate/terrain_map/terrain_input.h"
#include "surrogate/vehicle/vehicle_file.h"

namespace grouser::terrain_map {

/// What is asked of a map.
struct MapOptions {
  std::string vehicle, elevation, out;
  SoilSources soils;
  TableOptions table;
  double negligible = 0.05;  ///< of AnswerOf
  std::string pictures;      ///< Python script that draws them; empty: none
  std::string command;       ///< as it was called, for map.json
};

/// Bands of the rasters: straight up, down and across the slope (the slower of both ways across),
/// and eight headings of the grid, clockwise from north.
struct Direction {
  const char* name;
  Way way;
};
inline constexpr double kTurn = 2 * std::numbers::pi;
inline constexpr std::array<Direction, 11> kDirections = {{{"up", {false, 0, false}},
                                                           {"down", {false, kTurn / 2, false}},
                                                           {"across", {false, kTurn / 4, true}},
                                                           {"000", {true, 0, false}},
                                                           {"045", {true, kTurn / 8, false}},
                                                           {"090", {true, kTurn / 4, false}},
                                                           {"135", {true, kTurn * 3 / 8, false}},
                                                           {"180", {true, kTurn / 2, false}},
                                                           {"225", {true, kTurn * 5 / 8, false}},
                                                           {"270", {true, kTurn * 3 / 4, false}},
                                                           {"315", {true, kTurn * 7 / 8, false}}}};
inline constexpr std::size_t kFirstHeading = 3;

/// Cells by what became of them.
struct CellCounts {
  std::uint64_t cells = 0, holes = 0;  ///< hole: no answer (a hole among its nine, or at the edge)
  std::uint64_t all_ways = 0, no_way = 0;  ///< driven on all of the eight headings; on none
};

/// Makes the map. Returns why it has no pictures though some were asked for; else "". Throws
/// std::invalid_argument for bad input, Interrupted.
std::string MakeMap(const MapOptions& options, const HeldSignals& signals,
                    ProgressReport* progress);

/// Index of a soil of the vehicle file. Throws std::invalid_argument "OPTION: ...".
std::uint8_t SoilIndexOf(const vehicle::VehicleFile& file, const std::string& option,
                         const std::string& soil);

}  // namespace grouser::terrain_map
