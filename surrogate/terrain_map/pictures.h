#pragma once

#include <filesystem>
#include <string>

#include "surrogate/terrain_map/map_output.h"
#include "surrogate/terrain_map/progress.h"
#include "surrogate/terrain_map/terrain_input.h"

namespace grouser::terrain_map {

/// Writes FOLDER/thinned/NAME.npy (float32, bands x rows x columns, ThinnedSize
/// of 900) for the script
/// that draws: it needs no GDAL.
void KeepThinned(const std::filesystem::path& folder, RasterOutput* raster);
void KeepThinnedElevation(const std::filesystem::path& folder, const TerrainInput& terrain);

/// Runs `/usr/bin/python3 SCRIPT FOLDER`, then removes FOLDER/thinned. Throws std::runtime_error
/// where the script fails, Interrupted having ended it.
void DrawPictures(const std::string& script, const std::filesystem::path& folder,
                  const HeldSignals& signals, ProgressReport* progress);
/// What a script that failed has left, and FOLDER/thinned.
void RemovePictures(const std::filesystem::path& folder);

}  // namespace grouser::terrain_map
