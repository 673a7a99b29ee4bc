#include "surrogate/terrain_map/map_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "surrogate/terrain_map/map_json.h"
#include "surrogate/terrain_map/map_output.h"
#include "surrogate/terrain_map/pictures.h"
#include "surrogate/vehicle/yaml.h"

namespace grouser::terrain_map {
namespace {

constexpr std::size_t kTile = 512;
constexpr double kDegrees = 180 / std::numbers::pi;

/// The rasters of a map, and one tile of each.
class Rasters {
 public:
  Rasters(const std::filesystem::path& folder, const Grid& grid, bool with_most)
      : with_most_(with_most) {
    std::vector<std::string> names;
    for (const Direction& d : kDirections) names.emplace_back(d.name);
    using Cells = RasterOutput::Cells;
    rasters_.emplace_back(folder, "speed", grid, names, Cells::kNumbers, "m/s");
    rasters_.emplace_back(folder, "energy", grid, names, Cells::kNumbers, "J/m");
    rasters_.emplace_back(folder, "go_least", grid, names, Cells::kNumbers, "");
    if (with_most) rasters_.emplace_back(folder, "go_most", grid, names, Cells::kNumbers, "");
    binding_ = rasters_.size();
    rasters_.emplace_back(folder, "binding", grid, names, Cells::kBytes, "");
    for (const auto& [value, name] : BindingNames()) {
      rasters_.back().Tag(fmt::format("BINDING_{}", value), name);
    }
    const std::vector<std::string> slope = {"slope_deg", "up_azimuth_deg"};
    rasters_.emplace_back(folder, "slope", grid, slope, Cells::kNumbers, "deg");
  }

  void Resize(std::size_t cells) {
    cells_ = cells;
    const std::size_t n = kDirections.size() * cells;
    speed_.resize(n);
    energy_.resize(n);
    least_.resize(n);
    if (with_most_) most_.resize(n);
    binding_cells_.resize(n);
    slope_.resize(2 * cells);
  }
  /// Where the answers of a direction go.
  CellAnswers Of(std::size_t direction) {
    const auto part = [&](auto& all) { return std::span(all).subspan(direction * cells_, cells_); };
    return {part(speed_), part(energy_), part(least_),
            with_most_ ? part(most_) : std::span<float>(), part(binding_cells_)};
  }
  void PutSlope(std::size_t cell, double angle_rad, double up_azimuth_rad) {
    slope_[cell] = static_cast<float>(angle_rad * kDegrees);
    slope_[cells_ + cell] = static_cast<float>(up_azimuth_rad * kDegrees);
  }
  void Write(const Window& window) {
    rasters_[0].Write(window, speed_);
    rasters_[1].Write(window, energy_);
    rasters_[2].Write(window, least_);
    if (with_most_) rasters_[3].Write(window, most_);
    rasters_[binding_].Write(window, binding_cells_);
    rasters_.back().Write(window, slope_);
  }
  /// The rasters, once no tile follows: the memory of one goes.
  std::vector<RasterOutput>& Filled() {
    for (auto* cells : {&speed_, &energy_, &least_, &most_, &slope_}) *cells = std::vector<float>();
    binding_cells_ = std::vector<std::uint8_t>();
    return rasters_;
  }

 private:
  bool with_most_;
  std::vector<RasterOutput> rasters_;
  std::size_t binding_ = 0, cells_ = 0;
  std::vector<float> speed_, energy_, least_, most_, slope_;
  std::vector<std::uint8_t> binding_cells_;
};

/// Answers tile by tile.
class Tiles {
 public:
  Tiles(const TerrainInput& terrain, std::span<const SlopeTable> tables, double negligible,
        Rasters* rasters)
      : terrain_(terrain), tables_(tables), negligible_(negligible), rasters_(rasters) {}

  void Run(const Window& tile) {
    const std::size_t n = tile.cells();
    const Window halo = {tile.column - 1, tile.row - 1, tile.columns + 2, tile.rows + 2};
    terrain_.ReadElevation(halo, &elevation_);
    terrain_.ReadSoils(tile, &soils_);
    slope_.resize(n);
    azimuth_.resize(n);
    const Grid& grid = terrain_.grid();
    SlopesOf({elevation_, halo.rows, halo.columns, halo.columns, grid.width_m(), grid.height_m()},
             slope_, azimuth_);
    for (std::size_t i = 0; i < n; ++i) {
      if (std::isnan(slope_[i] + soils_[i])) slope_[i] = azimuth_[i] = std::nan("");
    }
    rasters_->Resize(n);
    for (std::size_t d = 0; d < kDirections.size(); ++d) {
      AnswerCells(tables_, negligible_, {slope_, azimuth_, soils_, n}, kDirections[d].way,
                  rasters_->Of(d));
    }
    for (std::size_t i = 0; i < n; ++i) {
      rasters_->PutSlope(i, slope_[i], azimuth_[i]);
      Count(i);
    }
    rasters_->Write(tile);
  }
  const CellCounts& counts() const { return counts_; }

 private:
  void Count(std::size_t cell) {
    ++counts_.cells;
    if (std::isnan(slope_[cell])) {
      ++counts_.holes;
      return;
    }
    std::size_t driven = 0;
    for (std::size_t d = kFirstHeading; d < kDirections.size(); ++d) {
      driven += rasters_->Of(d).speed[cell] > 0;
    }
    counts_.all_ways += driven == kDirections.size() - kFirstHeading;
    counts_.no_way += driven == 0;
  }

  const TerrainInput& terrain_;
  std::span<const SlopeTable> tables_;
  double negligible_;
  Rasters* rasters_;
  std::vector<float> elevation_, soils_;
  std::vector<double> slope_, azimuth_;
  CellCounts counts_;
};

CellCounts FillRasters(const TerrainInput& terrain, std::span<const SlopeTable> tables,
                       double negligible, Rasters* rasters, ProgressReport* progress) {
  Tiles tiles(terrain, tables, negligible, rasters);
  const Grid& grid = terrain.grid();
  progress->Stage(
      fmt::format("{} x {} cells, {} directions", grid.columns, grid.rows, kDirections.size()));
  for (std::size_t row = 0; row < grid.rows; row += kTile) {
    for (std::size_t column = 0; column < grid.columns; column += kTile) {
      tiles.Run({static_cast<std::ptrdiff_t>(column), static_cast<std::ptrdiff_t>(row),
                 std::min(kTile, grid.columns - column), std::min(kTile, grid.rows - row)});
      progress->Tick(static_cast<double>(tiles.counts().cells) /
                     (static_cast<double>(grid.columns) * static_cast<double>(grid.rows)));
    }
  }
  progress->Done();
  if (tiles.counts().holes == tiles.counts().cells) {
    throw std::invalid_argument(terrain.files()[0] +
                                ": elevation: got a hole among the nine cells around every cell, "
                                "expected heights");
  }
  return tiles.counts();
}

std::vector<SlopeTable> BuildTables(const vehicle::VehicleFile& file,
                                    const std::vector<std::string>& soils,
                                    const TableOptions& options, ProgressReport* progress) {
  std::vector<SlopeTable> tables;
  for (const std::string& soil : soils) {
    progress->Stage("slopes and headings on " + soil);
    tables.push_back(BuildTable(file.vehicle, file.grounds, SoilIndexOf(file, "soils", soil),
                                options, [&](double done) { progress->Tick(done); }));
    progress->Done();
  }
  return tables;
}

}  // namespace

std::uint8_t SoilIndexOf(const vehicle::VehicleFile& file, const std::string& option,
                         const std::string& soil) {
  const auto& soils = file.grounds.soils;
  const auto found = std::find(soils.begin(), soils.end(), soil);
  if (found == soils.end()) {
    throw std::invalid_argument(option + ": got " + soil + ", expected one of the vehicle file, " +
                                "such as " + vehicle::yaml::NearestOf(soil, soils));
  }
  return static_cast<std::uint8_t>(found - soils.begin());
}

std::string MakeMap(const MapOptions& options, const HeldSignals& signals,
                    ProgressReport* progress) {
  const vehicle::VehicleFile file = vehicle::ReadVehicle(options.vehicle);
  const TerrainInput terrain(options.elevation, options.soils);
  for (const std::string& soil : terrain.soils()) SoilIndexOf(file, "soils", soil);
  OutputFolder folder(options.out);
  const std::vector<SlopeTable> tables =
      BuildTables(file, terrain.soils(), options.table, progress);
  const bool with_most = std::any_of(tables.begin(), tables.end(),
                                     [](const SlopeTable& t) { return !t.most.empty(); });
  std::vector<std::string> names;
  CellCounts counts;
  {
    Rasters rasters(folder.partial(), terrain.grid(), with_most);
    counts = FillRasters(terrain, tables, options.negligible, &rasters, progress);
    for (RasterOutput& raster : rasters.Filled()) {
      if (!options.pictures.empty()) KeepThinned(folder.partial(), &raster);
      progress->Stage("writing " + raster.name() + ".tif");
      raster.Finish(progress);
      progress->Done();
      names.push_back(raster.name());
    }
  }
  progress->Stage("writing map.json");
  WriteMapJson(folder.partial() / "map.json", options, file, terrain, tables, counts, names,
               [&] { progress->Tick(0); });
  std::string no_pictures;
  if (!options.pictures.empty()) {
    progress->Stage("drawing pictures");
    try {
      KeepThinnedElevation(folder.partial(), terrain);
      DrawPictures(options.pictures, folder.partial(), signals, progress);
    } catch (const Interrupted&) {
      throw;
    } catch (const std::exception& e) {  // the map is what was asked for first
      no_pictures = e.what();
      RemovePictures(folder.partial());
    }
    progress->Done();
  }
  progress->Tick(1);
  folder.Publish();
  return no_pictures;
}

}  // namespace grouser::terrain_map
