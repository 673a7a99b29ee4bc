#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "surrogate/terrain_map/map_run.h"

namespace grouser::terrain_map {

/// Values of binding.tif and what they stand for.
std::vector<std::pair<int, std::string>> BindingNames();

/// map.json: what was asked, of which files, and what is in the folder. Bytes of names that are no
/// UTF-8 become U+FFFD. `tick` is called before each file is read, and may throw.
void WriteMapJson(const std::filesystem::path& path, const MapOptions& options,
                  const vehicle::VehicleFile& file, const TerrainInput& terrain,
                  std::span<const SlopeTable> tables, const CellCounts& counts,
                  const std::vector<std::string>& rasters, const std::function<void()>& tick);

}  // namespace grouser::terrain_map
