#include "clients/in_process/grouser/map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "clients/in_process/vehicle_parts.h"
#include "surrogate/terrain_map/build_table.h"
#include "surrogate/terrain_map/cells.h"

namespace grouser {
namespace {

static_assert(kNoSoil == terrain_map::kNoCell &&
              static_cast<std::uint8_t>(kNoCell) == terrain_map::kNoCell);
static_assert(sizeof(Binding) == sizeof(std::uint8_t));

constexpr std::size_t kStretch = 256;  // cells whose slopes are at hand at a time

terrain_map::TableOptions ToOurs(const MapOptions& o) {
  terrain_map::TableOptions options;
  options.limits = ToOurs(o.margins);
  options.limits.speed_limit_m_per_s = o.speed_limit;
  options.limits.worse_by_sd = o.worse_by_sd;
  return options;
}

// 0: more than can be counted.
std::size_t Product(std::size_t a, std::size_t b) noexcept {
  std::size_t product = 0;
  return __builtin_mul_overflow(a, b, &product) ? 0 : product;
}

// Entries of n cells from `first` on; none stays none.
template <class T>
std::span<T> Cut(std::span<T> span, std::size_t first, std::size_t n) noexcept {
  return span.empty() ? span : span.subspan(first, n);
}

// Of the cells of row r from column c on. Without a ring the outermost cells are holes.
void SlopesOf(const MapCells& in, std::size_t r, std::size_t c, std::span<double> slope,
              std::span<double> azimuth) noexcept {
  const double height = in.height > 0 ? in.height : in.width;
  if (in.elevation.size() != in.rows * in.columns) {
    const std::size_t wide = in.columns + 2;
    const auto heights = in.elevation.subspan(r * wide + c);
    terrain_map::SlopesOf({heights, 3, slope.size() + 2, wide, in.width, height}, slope, azimuth);
    return;
  }
  std::fill(slope.begin(), slope.end(), NAN);
  std::fill(azimuth.begin(), azimuth.end(), NAN);
  if (r == 0 || r + 1 == in.rows) return;
  const std::size_t first = std::max<std::size_t>(c, 1);
  const std::size_t last = std::min(c + slope.size(), in.columns - 1);  // one beyond it
  if (first >= last) return;
  const auto heights = in.elevation.subspan((r - 1) * in.columns + first - 1);
  terrain_map::SlopesOf({heights, 3, last - first + 2, in.columns, in.width, height},
                        slope.subspan(first - c), azimuth.subspan(first - c));
}

}  // namespace

struct TerrainMap::Parts {
  std::vector<terrain_map::SlopeTable> tables;
  double negligible;

  Fault FaultOf(const MapCells& in, const MapAnswers& out) const noexcept {
    FaultFinder finder;
    const std::size_t n = in.rows * in.columns;
    const bool heights = in.slope.empty() && in.up_azimuth.empty();
    // With their margin, and for each soil.
    constexpr std::size_t kMost = std::numeric_limits<std::size_t>::max() - 2;
    const bool counted = in.rows < kMost && in.columns < kMost &&
                         Product(in.rows + 2, in.columns + 2) > 0 &&
                         (n == 0 || Product(n, tables.size()) > 0);
    finder.Number(counted, "rows", static_cast<double>(in.rows),
                  "rows times columns that can be counted");
    if (heights) {
      if (in.elevation.size() != n) {
        finder.Size("elevation", in.elevation, (in.rows + 2) * (in.columns + 2), true);
      }
      finder.Number(in.width > 0 && std::isfinite(in.width), "width", in.width,
                    "a finite number above 0");
      finder.Number(in.height >= 0 && std::isfinite(in.height), "height", in.height,
                    "a finite number above 0, or 0");
    } else {
      finder.Size("slope", in.slope, n, true);
      finder.Size("up_azimuth", in.up_azimuth, n, true);
      finder.Number(in.elevation.empty(), "elevation", static_cast<double>(in.elevation.size()),
                    "no entry beside slopes");
    }
    finder.Size("soil", in.soil, n);
    finder.Size("probability", in.probability, n * tables.size());
    finder.Number(in.soil.empty() || in.probability.empty(), "soil",
                  static_cast<double>(in.soil.size()), "no entry beside probabilities");
    finder.Number(std::isfinite(in.way.angle), "way", in.way.angle, "a finite number");
    finder.Size("speed", out.speed, n);
    finder.Size("energy", out.energy, n);
    finder.Size("go_least", out.go_least, n);
    finder.Size("go_most", out.go_most, n);
    finder.Size("binding", out.binding, n);
    for (std::size_t i = 0; i < in.soil.size() && !finder.fault(); ++i) {
      finder.Number(in.soil[i] < tables.size() || in.soil[i] == kNoSoil, "soil", in.soil[i],
                    "an index into soils(), or kNoSoil", static_cast<std::ptrdiff_t>(i));
    }
    return finder.fault();
  }

  // Cells first to first + slope.size() of the block.
  void Answer(const MapCells& in, const MapAnswers& out, std::size_t first,
              std::span<const double> slope, std::span<const double> azimuth) const noexcept {
    const std::size_t n = slope.size(), all = in.rows * in.columns;
    std::span<std::uint8_t> binding;
    if (!out.binding.empty()) {
      binding = {reinterpret_cast<std::uint8_t*>(out.binding.data()) + first, n};
    }
    terrain_map::AnswerCells(
        tables, negligible,
        {.slope_rad = slope,
         .up_azimuth_rad = azimuth,
         .probability = in.probability.empty() ? in.probability : in.probability.subspan(first),
         .stride = all,
         .soil = Cut(in.soil, first, n)},
        {in.way.of_grid, in.way.angle, in.way.both_ways},
        {Cut(out.speed, first, n), Cut(out.energy, first, n), Cut(out.go_least, first, n),
         Cut(out.go_most, first, n), binding});
  }
};

TerrainMap::TerrainMap(const Vehicle& vehicle, const MapOptions& options,
                       const std::function<void(double)>& progress) try {
  FaultFinder finder;
  finder.Number(options.negligible >= 0 && options.negligible <= 1, "negligible",
                options.negligible, "0 to 1");
  finder.Number(options.speed_limit > 0 && std::isfinite(options.speed_limit), "speed_limit",
                options.speed_limit, "a finite number above 0");
  finder.Check(options.margins);
  if (finder.fault()) throw std::invalid_argument(finder.fault().Text());
  auto parts = std::make_shared<Parts>();
  parts->negligible = options.negligible;
  const vehicle::VehicleFile& file = vehicle.parts_->file;
  const double soils = static_cast<double>(vehicle.soils().size());
  for (std::size_t s = 0; s < vehicle.soils().size(); ++s) {
    parts->tables.push_back(
        terrain_map::BuildTable(file.vehicle, file.grounds, static_cast<std::uint8_t>(s),
                                ToOurs(options), [&](double done) {
                                  if (progress) progress((static_cast<double>(s) + done) / soils);
                                }));
  }
  parts_ = std::move(parts);
} catch (const vehicle::Stopped& error) {  // of a class that the caller can catch
  throw std::runtime_error(error.what());
}
TerrainMap::TerrainMap(const TerrainMap& other) noexcept = default;
TerrainMap& TerrainMap::operator=(const TerrainMap& other) noexcept = default;
TerrainMap::~TerrainMap() = default;

bool TerrainMap::Evaluate(const MapCells& in, const MapAnswers& out) const noexcept {
  const Parts& p = *parts_;
  if (p.FaultOf(in, out)) return false;
  if (in.rows * in.columns == 0) return true;  // no cell, however many rows
  if (!in.slope.empty()) {
    p.Answer(in, out, 0, in.slope, in.up_azimuth);
    return true;
  }
  std::array<double, kStretch> slope, azimuth;
  for (std::size_t r = 0; r < in.rows; ++r) {
    for (std::size_t c = 0; c < in.columns; c += kStretch) {
      const std::size_t some = std::min(kStretch, in.columns - c);
      SlopesOf(in, r, c, std::span(slope).first(some), std::span(azimuth).first(some));
      p.Answer(in, out, r * in.columns + c, std::span(slope).first(some),
               std::span(azimuth).first(some));
    }
  }
  return true;
}

std::string TerrainMap::Problem(const MapCells& cells, const MapAnswers& out) const {
  return parts_->FaultOf(cells, out).Text();
}

}  // namespace grouser
