#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "surrogate/terrain_map/progress.h"
#include "surrogate/terrain_map/raster_input.h"

namespace grouser::terrain_map {

/// A folder that is written aside, as NAME.partial-PID (or PID-1, ...) beside it, and gets its name
/// when all of it is there; else it is removed.
class OutputFolder {
 public:
  /// Throws std::invalid_argument where `folder` is there already or cannot be made.
  explicit OutputFolder(std::filesystem::path folder);
  ~OutputFolder();
  const std::filesystem::path& partial() const { return partial_; }
  void Publish();

 private:
  std::filesystem::path folder_, partial_;
  bool published_ = false;
};

/// Cells of a side of a raster thinned out to about at most `most` a side: both sides by one step,
/// neither below 2.
std::size_t ThinnedSize(std::size_t side, std::size_t longest, std::size_t most);

/// A raster that is written in windows, then made a cloud-optimised GeoTIFF: tiles of 512 cells,
/// overviews of single cells (no means), DEFLATE.
class RasterOutput {
 public:
  enum class Cells { kNumbers, kBytes };  ///< nodata: NaN, 255
  /// Writes FOLDER/NAME.tif; until Finish() FOLDER/NAME.part.
  RasterOutput(const std::filesystem::path& folder, const std::string& name, const Grid& grid,
               const std::vector<std::string>& bands, Cells cells, const std::string& unit);
  ~RasterOutput();
  RasterOutput(RasterOutput&&) noexcept;

  const std::string& name() const { return name_; }
  /// Items of the file's metadata.
  void Tag(const std::string& key, const std::string& value);
  /// `cells`: band by band, rows one after the other.
  void Write(const Window& window, std::span<const float> cells);
  void Write(const Window& window, std::span<const unsigned char> cells);
  /// The whole raster thinned out (ThinnedSize): band by band.
  std::vector<float> Thinned(std::size_t most, std::size_t* columns, std::size_t* rows);
  void Finish(ProgressReport* progress);

 private:
  void WriteCells(const Window& window, const void* cells, std::size_t bytes);
  [[noreturn]] void Fail(const std::string& what) const;

  std::string name_;
  std::filesystem::path part_, file_;
  std::size_t bands_;
  Cells cells_;
  std::unique_ptr<GDALDataset, void (*)(GDALDataset*)> data_;
};

}  // namespace grouser::terrain_map
