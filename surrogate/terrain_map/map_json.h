#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "surrogate/terrain_map/map_run.h"

namespace grouser::terrain_map {

/// Values of binding.tif and what they stand for.
std::vector<std::pair<int, std::string>> BindingNames();

/// map.json: what was asked, of which files, and what is in the folder.
void WriteMapJson(const std::filesystem::path& path, const MapOptions& options,
                  const vehicle::VehicleFile& file, const TerrainInput& terrain,
                  std::span<const SlopeTable> tables, const CellCounts& counts,
                  const std::vector<std::string>& rasters);

}  // namespace grouser::terrain_map
