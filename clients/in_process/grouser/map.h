#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "grouser/vehicle.h"

/// What a vehicle can drive of a terrain, cell by cell, in your own process: speed made good on a
/// heading, probability to go, energy per metre, and what binds. How: docs/maps.md. The answers are
/// those of `grouser map`, whose rasters are made by the same kernel, bit for bit.
namespace grouser {

struct MapOptions {
  double speed_limit = 1;           ///< > 0: never faster [m/s]
  double worse_by_sd = kWorseBySd;  ///< ground that must be stood, between -4 and 4
  Margins margins{};                ///< trained_only has to stay true
  /// Speed and energy leave out the least probable soils of a cell while their sum is below it.
  double negligible = 0.05;
};

/// The soil of a hole, and what binds there.
inline constexpr std::uint8_t kNoSoil = 255;
inline constexpr Binding kNoCell = static_cast<Binding>(255);

/// Which way cells are driven.
struct MapWay {
  /// A heading of the grid, clockwise from north [rad].
  static constexpr MapWay Azimuth(double azimuth) { return {azimuth, true, false}; }
  /// A heading from the way up, positive to the left [rad]: 0 straight up, pi straight down.
  static constexpr MapWay FromUp(double angle) { return {angle, false, false}; }
  /// Across the slope, the slower of both ways.
  static constexpr MapWay Across() { return {1.5707963267948966, false, true}; }

  double angle = 0;
  bool of_grid = true, both_ways = false;
};

/// A map, or a block of one, of n = rows x columns cells, rows from north to south, columns from
/// west to east. Nothing is kept between blocks.
struct MapCells {
  std::size_t rows = 0, columns = 0;
  double width = 0, height = 0;  ///< of a cell, eastward and northward [m]; 0: square
  /// Heights [m]: n entries, and the outermost cells are holes; or those of the ring of cells about
  /// the block too, (rows + 2) x (columns + 2), and none is. A NaN among the nine around a cell
  /// makes it a hole. Slopes by Horn's weighted differences (1981).
  std::span<const float> elevation{};
  /// Or slopes, n entries: angle from the level, and azimuth of the way up, clockwise from north
  /// [rad]. NaN: a hole, but for an azimuth where it does not count: on the level, and on headings
  /// from the way up.
  std::span<const double> slope{}, up_azimuth{};
  /// Index into soils() of the vehicle, n entries (kNoSoil: a hole); none: the first.
  std::span<const std::uint8_t> soil{};
  /// Or probabilities of all soils(), soil by soil, n entries each, whose sum is 1 in every cell.
  /// NaN of the first: a hole.
  std::span<const float> probability{};
  MapWay way{};  ///< northward, if none is given
};

/// Where the answers go: n entries, or none and costs nothing.
struct MapAnswers {
  std::span<float> speed{};   ///< made good: v cos(grade) of the highest safe speed; 0: not driven
  std::span<float> energy{};  ///< on mean ground at that speed [J/m of the map]; NaN: not driven
  /// P(GO) creeping; `go_most` where ground that the models' runs do not cover counts as going.
  std::span<float> go_least{}, go_most{};
  std::span<Binding> binding{};  ///< what keeps it from being faster, or from being driven
};

/// An immutable table of what a vehicle does on slopes of its soils. Copies share it. Const members
/// may be called from any number of threads at once.
class GROUSER_PUBLIC TerrainMap {
 public:
  /// Tabulates all soils() of the vehicle: seconds each. `progress` is called now and then with the
  /// share that is done and may throw, which ends it. Throws std::invalid_argument for options that
  /// make no sense.
  explicit TerrainMap(const Vehicle& vehicle, const MapOptions& options = {},
                      const std::function<void(double)>& progress = nullptr);
  TerrainMap(const TerrainMap& other) noexcept;
  TerrainMap& operator=(const TerrainMap& other) noexcept;
  ~TerrainMap();

  /// Answers all cells on their way. False, having written nothing, where Problem says something.
  /// No allocation, lock or system call.
  [[nodiscard]] bool Evaluate(const MapCells& cells, const MapAnswers& out) const noexcept;
  /// Which span or number makes it refuse, e.g. "speed: 8 entries, expected 12 or none"; empty if
  /// none does. Allocates.
  std::string Problem(const MapCells& cells, const MapAnswers& out) const;

 private:
  struct Parts;
  std::shared_ptr<const Parts> parts_;
};

}  // namespace grouser
