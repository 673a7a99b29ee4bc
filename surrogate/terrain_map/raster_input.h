#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

class GDALDataset;

namespace grouser::terrain_map {

/// Where a raster's cells lie.
struct Grid {
  std::size_t columns = 0, rows = 0;
  std::array<double, 6> transform{};  ///< GDAL's: x = t0 + t1 column, y = t3 + t5 row
  std::string crs_wkt, crs_name;
  double width_m() const { return transform[1]; }
  double height_m() const { return -transform[5]; }
};

/// Cells of a raster; may reach over its edges.
struct Window {
  std::ptrdiff_t column = 0, row = 0;
  std::size_t columns = 0, rows = 0;
  std::size_t cells() const { return columns * rows; }
};

/// One band of numbers that GDAL reads, checked: north up, projected, metres that are metres on the
/// ground within 2 %. Every refusal is a
/// std::invalid_argument "FILE: got X, expected Y".
class RasterInput {
 public:
  /// `what`: of what kind it is, for messages. `heights`: the unit of the cells has to be metres,
  /// and they lie within 20 km of 0.
  RasterInput(const std::string& file, const std::string& what, bool heights);
  ~RasterInput();
  RasterInput(RasterInput&&) noexcept;

  const std::string& file() const { return file_; }
  const Grid& grid() const { return grid_; }
  /// Refuses a raster of another size, place or reference system.
  void CheckSameGrid(const RasterInput& reference) const;
  /// Rows of the window one after the other; NaN: a hole (nodata, masked), or outside of the
  /// raster. A cell that is not a finite number and no hole is refused.
  void Read(const Window& window, std::vector<float>* out) const;

 private:
  [[noreturn]] void Refuse(const std::string& got, const std::string& expected) const;
  void CheckPlace();
  void CheckLengths() const;
  void CheckNumber(double value, std::ptrdiff_t column, std::ptrdiff_t row) const;

  std::string file_, what_;
  bool heights_;
  Grid grid_;
  std::unique_ptr<GDALDataset, void (*)(GDALDataset*)> data_;
  double scale_ = 1, offset_ = 0;
};

/// Registers GDAL's drivers, bounds its memory and keeps its messages for the refusals. Once,
/// first.
void StartGdal();
/// Most memory of GDAL's cache of blocks.
void LimitGdalCache(std::size_t mebibytes);
/// GDAL's last message, on one line; "no cause given" where there is none.
std::string GdalCause();

}  // namespace grouser::terrain_map
