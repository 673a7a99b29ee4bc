#include "surrogate/terrain_map/map_output.h"

#include <cpl_string.h>
#include <gdal_priv.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <limits>
#include <stdexcept>

namespace grouser::terrain_map {
namespace {

// COG has all bands of 512 x 512 cells in one block: 11.5 MiB of eleven.
constexpr std::size_t kCopyCacheMebibytes = 16;

void Close(GDALDataset* data) { GDALClose(data); }

/// GDAL's progress function: no exception may cross its C code.
struct Watch {
  ProgressReport* progress;
  std::exception_ptr thrown;
  static int Tick(double done, const char*, void* self) {
    auto* watch = static_cast<Watch*>(self);
    try {
      watch->progress->Tick(done);
    } catch (...) {
      watch->thrown = std::current_exception();
      return FALSE;
    }
    return TRUE;
  }
};

}  // namespace

OutputFolder::OutputFolder(std::filesystem::path folder) : folder_(std::move(folder)) {
  while (!folder_.empty() && folder_.filename().empty()) folder_ = folder_.parent_path();
  if (folder_.empty() || std::filesystem::exists(folder_)) {
    throw std::invalid_argument("--out: got " + folder_.string() +
                                ", which is there, expected a folder that is not");
  }
  const std::string name = folder_.string() + ".partial-" + std::to_string(getpid());
  std::error_code error;
  if (folder_.has_parent_path()) {
    std::filesystem::create_directories(folder_.parent_path(), error);
  }
  // One that is there is of a process that was killed, or of another machine on the same disk.
  bool made = false;
  partial_ = name;
  for (int n = 1; !error && !made; ++n) {
    made = std::filesystem::create_directory(partial_, error);
    if (!made && !error) partial_ = name + "-" + std::to_string(n);
  }
  if (error) {
    throw std::invalid_argument("--out: " + partial_.string() +
                                " cannot be made: " + error.message());
  }
}

std::size_t ThinnedSize(std::size_t side, std::size_t longest, std::size_t most) {
  const std::size_t step = (longest + most - 1) / most;
  return std::max<std::size_t>(2, side / step);
}

OutputFolder::~OutputFolder() {
  std::error_code error;
  if (!published_) std::filesystem::remove_all(partial_, error);
}

void OutputFolder::Publish() {
  std::filesystem::rename(partial_, folder_);
  published_ = true;
}

RasterOutput::RasterOutput(const std::filesystem::path& folder, const std::string& name,
                           const Grid& grid, const std::vector<std::string>& bands, Cells cells,
                           const std::string& unit)
    : name_(name),
      part_(folder / (name + ".part")),
      file_(folder / (name + ".tif")),
      bands_(bands.size()),
      cells_(cells),
      data_(nullptr, Close) {
  CPLStringList options;
  for (const char* o : {"TILED=YES", "BLOCKXSIZE=512", "BLOCKYSIZE=512", "INTERLEAVE=BAND",
                        "BIGTIFF=IF_SAFER", "SPARSE_OK=YES"}) {
    options.AddString(o);
  }
  CPLErrorReset();
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  data_.reset(driver->Create(part_.c_str(), static_cast<int>(grid.columns),
                             static_cast<int>(grid.rows), static_cast<int>(bands_),
                             cells == Cells::kBytes ? GDT_Byte : GDT_Float32, options.List()));
  if (data_ == nullptr) Fail("cannot be made");
  auto transform = grid.transform;
  data_->SetGeoTransform(transform.data());
  data_->SetProjection(grid.crs_wkt.c_str());
  for (std::size_t b = 0; b < bands_; ++b) {
    GDALRasterBand* band = data_->GetRasterBand(static_cast<int>(b) + 1);
    band->SetDescription(bands[b].c_str());
    band->SetNoDataValue(cells == Cells::kBytes ? 255 : std::numeric_limits<double>::quiet_NaN());
    if (!unit.empty()) band->SetUnitType(unit.c_str());
  }
}
RasterOutput::~RasterOutput() = default;
RasterOutput::RasterOutput(RasterOutput&&) noexcept = default;

void RasterOutput::Fail(const std::string& what) const {
  throw std::runtime_error(file_.string() + ": " + what + ": " + GdalCause());
}

void RasterOutput::Tag(const std::string& key, const std::string& value) {
  data_->SetMetadataItem(key.c_str(), value.c_str());
}

void RasterOutput::WriteCells(const Window& w, const void* cells, std::size_t bytes) {
  const GDALDataType type = cells_ == Cells::kBytes ? GDT_Byte : GDT_Float32;
  const auto* from = static_cast<const unsigned char*>(cells);
  for (std::size_t b = 0; b < bands_; ++b) {
    void* band = const_cast<unsigned char*>(from + b * w.cells() * bytes);  // GDAL reads it alone
    if (data_->GetRasterBand(static_cast<int>(b) + 1)
            ->RasterIO(GF_Write, static_cast<int>(w.column), static_cast<int>(w.row),
                       static_cast<int>(w.columns), static_cast<int>(w.rows), band,
                       static_cast<int>(w.columns), static_cast<int>(w.rows), type, 0, 0,
                       nullptr) != CE_None) {
      Fail("cannot be written");
    }
  }
}
void RasterOutput::Write(const Window& w, std::span<const float> cells) {
  WriteCells(w, cells.data(), sizeof(float));
}
void RasterOutput::Write(const Window& w, std::span<const unsigned char> cells) {
  WriteCells(w, cells.data(), 1);
}

std::vector<float> RasterOutput::Thinned(std::size_t most, std::size_t* columns,
                                         std::size_t* rows) {
  const auto width = static_cast<std::size_t>(data_->GetRasterXSize());
  const auto height = static_cast<std::size_t>(data_->GetRasterYSize());
  *columns = ThinnedSize(width, std::max(width, height), most);
  *rows = ThinnedSize(height, std::max(width, height), most);
  std::vector<float> out(bands_ * *columns * *rows);
  for (std::size_t b = 0; b < bands_; ++b) {
    if (data_->GetRasterBand(static_cast<int>(b) + 1)
            ->RasterIO(GF_Read, 0, 0, static_cast<int>(width), static_cast<int>(height),
                       &out[b * *columns * *rows], static_cast<int>(*columns),
                       static_cast<int>(*rows), GDT_Float32, 0, 0, nullptr) != CE_None) {
      Fail("cannot be read again");
    }
  }
  return out;
}

void RasterOutput::Finish(ProgressReport* progress) {
  CPLStringList options;
  for (const char* o :
       {"BLOCKSIZE=512", "COMPRESS=DEFLATE", "LEVEL=1", "PREDICTOR=YES", "BIGTIFF=IF_SAFER",
        "OVERVIEW_RESAMPLING=NEAREST", "NUM_THREADS=ALL_CPUS"}) {
    options.AddString(o);
  }
  CPLErrorReset();
  if (data_->FlushCache(true); CPLGetLastErrorType() >= CE_Failure) Fail("cannot be written");
  LimitGdalCache(kCopyCacheMebibytes);
  Watch watch{progress, nullptr};
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("COG");
  if (driver == nullptr) Fail("this GDAL has no COG driver");
  GDALDataset* made =
      driver->CreateCopy(file_.c_str(), data_.get(), FALSE, options.List(), Watch::Tick, &watch);
  const bool failed = made == nullptr;
  if (!failed) GDALClose(made);
  if (watch.thrown) std::rethrow_exception(watch.thrown);
  if (failed || CPLGetLastErrorType() >= CE_Failure) Fail("cannot be written");
  data_.reset();
  std::filesystem::remove(part_);
}

}  // namespace grouser::terrain_map
