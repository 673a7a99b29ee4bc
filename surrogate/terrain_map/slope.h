#pragma once

#include <cstddef>
#include <span>

/// Slopes of an elevation raster and what they are to a vehicle on a heading. Rows go south,
/// columns east; azimuths are clockwise from north (of the grid), radians.
namespace grouser::terrain_map {

/// Slope of the ground: angle from the level, and azimuth of the way up (0 where it is level).
struct Slope {
  double angle_rad = 0, up_azimuth_rad = 0;
};

/// Three neighbouring rows of elevations [m] from north to south, each with `columns` entries.
struct Rows {
  std::span<const float> north, middle, south;
};

/// Slope at column 1 to columns - 2, by the weighted differences of Horn (1981,
/// docs/references.md), with cells of width x height metres:
///   dz/dx = ((z_ne + 2 z_e + z_se) - (z_nw + 2 z_w + z_sw))/(8 width),   dz/dy so with height.
/// A NaN among the nine gives NaN.
Slope SlopeAt(const Rows& rows, std::size_t column, double width_m, double height_m) noexcept;

/// Grade and bank of the vehicle (surrogate/vehicle/solver.h: the ground rises ahead, to the left).
struct Attitude {
  double grade_rad = 0, bank_rad = 0;
};

/// Attitude on a slope t, with the heading h in the plane of the map measured from the way up,
/// positive to the left (anticlockwise from above):
///   tan(grade) = tan(t) cos(h),  sin(bank) = -sin(t) sin(h), so that cos(grade) cos(bank) =
///   cos(t).
Attitude AttitudeOf(double slope_rad, double heading_rad) noexcept;

/// The inverse: slope, and heading from the way up in (-pi, pi].
struct SlopeHeading {
  double slope_rad = 0, heading_rad = 0;
};
SlopeHeading SlopeHeadingOf(const Attitude& attitude) noexcept;

}  // namespace grouser::terrain_map
