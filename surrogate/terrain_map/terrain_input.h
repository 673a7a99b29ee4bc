#pragma once

#include <optional>
#include <string>
#include <vector>

#include "surrogate/terrain_map/raster_input.h"

namespace grouser::terrain_map {

/// Which soil lies where, as the command line says it.
struct SoilSources {
  std::string soil;                                                ///< one everywhere
  std::string class_raster;                                        ///< or by class
  std::vector<std::pair<int, std::string>> classes;                ///< value of the raster, soil
  std::vector<std::pair<std::string, std::string>> probabilities;  ///< or soil, raster
};

/// Elevation and soils of a map, read in windows.
class TerrainInput {
 public:
  /// Throws std::invalid_argument for rasters that cannot be used, or that do not fit each other.
  TerrainInput(const std::string& elevation, const SoilSources& sources);

  const Grid& grid() const { return elevation_.grid(); }
  const std::vector<std::string>& soils() const { return soils_; }  ///< each once
  std::vector<std::string> files() const;

  /// Elevations [m]; NaN: a hole or outside.
  void ReadElevation(const Window& window, std::vector<float>* out) const {
    elevation_.Read(window, out);
  }
  /// Probability of each soil, soil by soil, NaN in holes. Throws std::invalid_argument for a class
  /// without soil, and for probabilities below 0 or whose sum is not 1 within 0.01 (they are then
  /// divided by it).
  void ReadSoils(const Window& window, std::vector<float>* out) const;

 private:
  void ReadClasses(const Window& window, std::vector<float>* out) const;
  void ReadProbabilities(const Window& window, std::vector<float>* out) const;

  RasterInput elevation_;
  std::vector<std::string> soils_;
  std::optional<RasterInput> classes_;
  std::vector<std::pair<int, std::size_t>> soil_of_class_;
  std::vector<RasterInput> probabilities_;  // by soil
};

}  // namespace grouser::terrain_map
