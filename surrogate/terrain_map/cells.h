#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "surrogate/terrain_map/cell.h"
#include "surrogate/terrain_map/slope.h"

namespace grouser::terrain_map {

inline constexpr std::uint8_t kNoCell = 255;  ///< what binds, or the soil, of a hole

/// A block of cells, rows from north to south one after the other. Spans have an entry a cell.
struct Cells {
  /// Of Slope; NaN: a hole. The azimuth counts on ways of the grid alone, and not where the slope
  /// is 0.
  std::span<const double> slope_rad, up_azimuth_rad;
  /// Probability of each soil (of each table), soil by soil, `stride` entries from one to the next;
  /// NaN: a hole. Or none, and `soil` is the index of each cell's table, kNoCell: a hole. Or
  /// neither: the first.
  std::span<const float> probability{};
  std::size_t stride = 0;
  std::span<const std::uint8_t> soil{};
};

/// Which way a cell is driven.
struct Way {
  bool of_grid;  ///< an azimuth clockwise from north; else a heading from the way up, to the left
  double angle_rad;
  bool both_ways;  ///< the slower one of angle and -angle
};

/// Where answers go: an entry a cell, or none.
struct CellAnswers {
  std::span<float> speed, energy, go_least, go_most;  ///< of CellAnswer; NaN: a hole
  std::span<std::uint8_t> binding;                    ///< kNoCell: a hole
};

/// Heights of rows x columns cells, `stride` entries from a row to the next.
struct Heights {
  std::span<const float> heights_m;
  std::size_t rows, columns, stride;
  double width_m, height_m;  ///< of a cell
};

/// Slopes of the inner cells, by SlopeAt: (rows - 2) (columns - 2).
void SlopesOf(const Heights& in, std::span<double> slope_rad,
              std::span<double> up_azimuth_rad) noexcept;

/// Answers of all cells on one way, by AnswerOf. No allocation. Precondition: one table or more, at
/// most vehicle::kMostSoils.
void AnswerCells(std::span<const SlopeTable> tables, double negligible, const Cells& cells,
                 const Way& way, const CellAnswers& out) noexcept;

}  // namespace grouser::terrain_map
