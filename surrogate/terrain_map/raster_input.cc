#include "surrogate/terrain_map/raster_input.h"

#include <fmt/format.h>
#include <gdal_priv.h>
#include <malloc.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace grouser::terrain_map {
namespace {

constexpr double kMostHeight = 2e4;    // [m]
constexpr double kMostStretch = 0.02;  // of a metre of the map on the ground
constexpr const char* kMetres =
    "a projected one with metres of the ground (gdalwarp -t_srs EPSG:..., such as UTM)";

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
  LimitGdalCache(64);  // a row of tiles of an input in strips
#ifdef M_MMAP_THRESHOLD
  // Blocks of many bands go back to the system: else what lies between them keeps it from that.
  mallopt(M_MMAP_THRESHOLD, 1 << 20);
#endif
}

void LimitGdalCache(std::size_t mebibytes) {
  GDALSetCacheMax64(static_cast<std::int64_t>(mebibytes) << 20);
}

std::string GdalCause() {
  std::string cause = CPLGetLastErrorMsg();
  std::replace(cause.begin(), cause.end(), '\n', ' ');
  return cause.empty() ? "no cause given" : cause;
}

RasterInput::RasterInput(const std::string& file, const std::string& what, bool heights)
    : file_(file), what_(what), heights_(heights), data_(nullptr, Close) {
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
  CheckPlace();
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

void RasterInput::CheckPlace() {
  const std::string metres = kMetres;
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
  std::array<double, 6>& t = grid_.transform;
  if (data_->GetGeoTransform(t.data()) != CE_None) Refuse("no geotransform", "one");
  if (t[2] != 0 || t[4] != 0 || !(t[1] > 0) || !(t[5] < 0) || !std::isfinite(t[1] * t[5])) {
    Refuse(fmt::format("a geotransform of {}, {}, {}, {}", t[1], t[2], t[4], t[5]),
           "north up: width > 0, 0, 0, height < 0");
  }
  if (grid_.columns < 3 || grid_.rows < 3) {
    Refuse(fmt::format("{} x {} cells", grid_.columns, grid_.rows), "3 x 3 or more");
  }
  CheckLengths();
  const std::string unit_type = TextOf(data_->GetRasterBand(1)->GetUnitType());
  std::string cells = unit_type;
  std::transform(cells.begin(), cells.end(), cells.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array kUnits = {"", "m", "metre", "metres", "meter", "meters"};
  if (heights_ && std::find(kUnits.begin(), kUnits.end(), cells) == kUnits.end()) {
    Refuse("heights in " + unit_type, "metres");
  }
}

// Steps of a cell to the east, north-east, south-east and south at centre and corners, by the radii
// of curvature M, N of the ellipsoid: ds^2 = (M dlat)^2 + (N cos(lat) dlon)^2.
void RasterInput::CheckLengths() const {
  OGRSpatialReference crs(*data_->GetSpatialRef());
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRSpatialReference> degrees(crs.CloneGeogCS());
  if (degrees == nullptr) Refuse("no ellipsoid (" + grid_.crs_name + ")", kMetres);
  degrees->SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> to(
      OGRCreateCoordinateTransformation(&crs, degrees.get()));
  if (to == nullptr) Refuse("no way to degrees (" + GdalCause() + ")", kMetres);
  const double a = crs.GetSemiMajor(), flattening = crs.GetInvFlattening();
  const double f = flattening > 0 ? 1 / flattening : 0, e2 = f * (2 - f);
  const double radians = degrees->GetAngularUnits();
  const auto& t = grid_.transform;
  const auto columns = static_cast<double>(grid_.columns), rows = static_cast<double>(grid_.rows);
  const std::array<std::array<double, 2>, 5> places = {{{columns / 2, rows / 2},
                                                        {0.5, 0.5},
                                                        {columns - 0.5, 0.5},
                                                        {0.5, rows - 0.5},
                                                        {columns - 0.5, rows - 0.5}}};
  const std::array<std::array<double, 2>, 4> steps = {{{1, 0}, {1, -1}, {1, 1}, {0, 1}}};
  for (const auto& [column, row] : places) {
    for (const auto& [east, south] : steps) {
      std::array<double, 2> x, y;
      for (const int end : {0, 1}) {
        x[end] = t[0] + t[1] * (column + (end - 0.5) * east);
        y[end] = t[3] + t[5] * (row + (end - 0.5) * south);
      }
      if (to->Transform(2, x.data(), y.data()) == FALSE) {
        Refuse(fmt::format("cells outside of the projection {}", grid_.crs_name), kMetres);
      }
      const double lat = (y[0] + y[1]) / 2 * radians, w = 1 - e2 * std::pow(std::sin(lat), 2);
      const double north = a * (1 - e2) / std::pow(w, 1.5) * (y[1] - y[0]) * radians;
      const double along = a / std::sqrt(w) * std::cos(lat) *
                           std::remainder((x[1] - x[0]) * radians, 2 * std::numbers::pi);
      const double share = std::hypot(north, along) / std::hypot(t[1] * east, t[5] * south);
      if (std::fabs(share - 1) <= kMostStretch) continue;
      Refuse(fmt::format("a projection ({}) whose metre is {:.3f} m on the ground at column {:.0f},"
                         " row {:.0f}",
                         grid_.crs_name, share, std::floor(column), std::floor(row)),
             kMetres);
    }
  }
}

void RasterInput::CheckNumber(double value, std::ptrdiff_t column, std::ptrdiff_t row) const {
  const bool finite = std::isfinite(value);
  if (finite && (!heights_ || std::fabs(value) <= kMostHeight)) return;
  Refuse(fmt::format("{} at column {}, row {}", value, column, row),
         std::string(finite ? "a height within 20 km of 0" : "a finite number") +
             ", or a nodata value that says that there is none");
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
      const double value = values[i] * scale_ + offset_;
      CheckNumber(value, left + c, top + r);
      const auto row = static_cast<std::size_t>(top + r - w.row);
      const auto column = static_cast<std::size_t>(left + c - w.column);
      (*out)[row * w.columns + column] = static_cast<float>(value);
    }
  }
}

}  // namespace grouser::terrain_map
