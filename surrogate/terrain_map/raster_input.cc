#include "surrogate/terrain_map/raster_input.h"

#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>

namespace grouser::terrain_map {
namespace {

void Close(GDALDataset* data) { GDALClose(data); }

std::string TextOf(const char* text) { return text == nullptr ? "" : text; }

std::string WktOf(const OGRSpatialReference& crs) {
  char* text = nullptr;
  crs.exportToWkt(&text);
  const std::string out = TextOf(text);
  CPLFree(text);
  return out;
}

}  // namespace

void StartGdal() {
  GDALAllRegister();
  CPLSetErrorHandler(CPLQuietErrorHandler);
  GDALSetCacheMax64(std::int64_t{256} << 20);  // not a share of the memory
}

std::string GdalCause() {
  std::string cause = CPLGetLastErrorMsg();
  std::replace(cause.begin(), cause.end(), '\n', ' ');
  return cause.empty() ? "no cause given" : cause;
}

RasterInput::RasterInput(const std::string& file, const std::string& what, bool heights)
    : file_(file), what_(what), data_(nullptr, Close) {
  CPLErrorReset();
  data_.reset(GDALDataset::Open(file.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY));
  if (data_ == nullptr) Refuse("no raster (" + GdalCause() + ")", "a GeoTIFF");
  if (data_->GetRasterCount() != 1) {
    Refuse(std::to_string(data_->GetRasterCount()) + " bands", "1 band");
  }
  grid_.columns = static_cast<std::size_t>(data_->GetRasterXSize());
  grid_.rows = static_cast<std::size_t>(data_->GetRasterYSize());
  if (GDALDataTypeIsComplex(data_->GetRasterBand(1)->GetRasterDataType()) != 0) {
    Refuse("complex numbers", "real ones");
  }
  CheckPlace(heights);
  int given = 0;
  const double scale = data_->GetRasterBand(1)->GetScale(&given);
  if (given != 0) scale_ = scale;
  const double offset = data_->GetRasterBand(1)->GetOffset(&given);
  if (given != 0) offset_ = offset;
}
RasterInput::~RasterInput() = default;
RasterInput::RasterInput(RasterInput&&) noexcept = default;

void RasterInput::Refuse(const std::string& got, const std::string& expected) const {
  throw std::invalid_argument(file_ + ": " + what_ + ": got " + got + ", expected " + expected);
}

void RasterInput::CheckPlace(bool heights) {
  const std::string metres = "a projected one in metres (gdalwarp -t_srs EPSG:..., such as UTM)";
  const OGRSpatialReference* crs = data_->GetSpatialRef();
  if (crs == nullptr || crs->IsEmpty()) Refuse("no coordinate reference system", metres);
  grid_.crs_name = TextOf(crs->GetName());
  grid_.crs_wkt = WktOf(*crs);
  if (crs->IsGeographic() != 0) {
    Refuse("a coordinate reference system in degrees (" + grid_.crs_name + ")", metres);
  }
  if (crs->IsProjected() == 0) {
    Refuse("a coordinate reference system without projection (" + grid_.crs_name + ")", metres);
  }
  const char* unit = nullptr;
  if (std::fabs(crs->GetLinearUnits(&unit) - 1) > 1e-9) {
    Refuse("a coordinate reference system in " + TextOf(unit), metres);
  }
  if (TextOf(crs->GetAttrValue("PROJECTION")).starts_with("Mercator")) {
    Refuse(
        "a Mercator projection (" + grid_.crs_name + "), whose metres are not metres on the ground",
        metres);
  }
  std::array<double, 6>& t = grid_.transform;
  if (data_->GetGeoTransform(t.data()) != CE_None) Refuse("no geotransform", "one");
  if (t[2] != 0 || t[4] != 0 || !(t[1] > 0) || !(t[5] < 0) || !std::isfinite(t[1] * t[5])) {
    Refuse(fmt::format("a geotransform of {}, {}, {}, {}", t[1], t[2], t[4], t[5]),
           "north up: width > 0, 0, 0, height < 0");
  }
  if (grid_.columns < 3 || grid_.rows < 3) {
    Refuse(fmt::format("{} x {} cells", grid_.columns, grid_.rows), "3 x 3 or more");
  }
  const std::string cells = TextOf(data_->GetRasterBand(1)->GetUnitType());
  if (heights && !cells.empty() && cells != "m" && cells != "metre" && cells != "meter") {
    Refuse("heights in " + cells, "metres");
  }
}

void RasterInput::CheckSameGrid(const RasterInput& reference) const {
  const Grid &a = grid_, &b = reference.grid_;
  if (a.columns != b.columns || a.rows != b.rows) {
    Refuse(fmt::format("{} x {} cells", a.columns, a.rows),
           fmt::format("{} x {}, those of {}", b.columns, b.rows, reference.file_));
  }
  for (std::size_t i = 0; i < a.transform.size(); ++i) {
    // A thousandth of a cell at the far corner.
    const double scale = i == 0 || i == 3 ? 1e-3 : 1e-3 / static_cast<double>(a.columns + a.rows);
    if (std::fabs(a.transform[i] - b.transform[i]) > scale * b.width_m()) {
      Refuse(fmt::format("origin ({}, {}) and cells of {} x {} m", a.transform[0], a.transform[3],
                         a.width_m(), a.height_m()),
             fmt::format("({}, {}) and {} x {} m, those of {}", b.transform[0], b.transform[3],
                         b.width_m(), b.height_m(), reference.file_));
    }
  }
  const OGRSpatialReference mine(a.crs_wkt.c_str()), other(b.crs_wkt.c_str());
  if (mine.IsSame(&other) == 0) {
    Refuse("the coordinate reference system " + a.crs_name,
           b.crs_name + ", that of " + reference.file_);
  }
}

void RasterInput::Read(const Window& w, std::vector<float>* out) const {
  const auto clip = [](std::ptrdiff_t at, std::size_t size) {
    return std::clamp<std::ptrdiff_t>(at, 0, static_cast<std::ptrdiff_t>(size));
  };
  const auto last = [](std::ptrdiff_t at, std::size_t n) {
    return at + static_cast<std::ptrdiff_t>(n);
  };
  const std::ptrdiff_t left = clip(w.column, grid_.columns), top = clip(w.row, grid_.rows);
  const std::ptrdiff_t right = clip(last(w.column, w.columns), grid_.columns);
  const std::ptrdiff_t bottom = clip(last(w.row, w.rows), grid_.rows);
  const int columns = static_cast<int>(right - left), rows = static_cast<int>(bottom - top);
  out->assign(w.cells(), std::numeric_limits<float>::quiet_NaN());
  if (columns <= 0 || rows <= 0) return;
  std::vector<double> values(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  std::vector<unsigned char> valid(values.size());
  GDALRasterBand* band = data_->GetRasterBand(1);
  const auto read = [&](GDALRasterBand* from, void* to, GDALDataType type) {
    CPLErrorReset();
    if (from->RasterIO(GF_Read, static_cast<int>(left), static_cast<int>(top), columns, rows, to,
                       columns, rows, type, 0, 0, nullptr) != CE_None) {
      throw std::runtime_error(file_ + ": cannot be read: " + GdalCause());
    }
  };
  read(band, values.data(), GDT_Float64);
  read(band->GetMaskBand(), valid.data(), GDT_Byte);
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const std::size_t i = static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) +
                            static_cast<std::size_t>(c);
      if (valid[i] == 0) continue;
      if (!std::isfinite(values[i])) {
        Refuse(fmt::format("{} at column {}, row {}", values[i], left + c, top + r),
               "a finite number, or a nodata value that says that there is none");
      }
      const auto row = static_cast<std::size_t>(top + r - w.row);
      const auto column = static_cast<std::size_t>(left + c - w.column);
      (*out)[row * w.columns + column] = static_cast<float>(values[i] * scale_ + offset_);
    }
  }
}

}  // namespace grouser::terrain_map
