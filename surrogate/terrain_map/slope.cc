#include "surrogate/terrain_map/slope.h"

#include <cmath>
#include <numbers>

namespace grouser::terrain_map {

Slope SlopeAt(const Rows& r, std::size_t c, double width_m, double height_m) noexcept {
  const auto column = [&](std::size_t k) {
    return double{r.north[k]} + 2 * double{r.middle[k]} + double{r.south[k]};
  };
  const auto row = [&](std::span<const float> z) {
    return double{z[c - 1]} + 2 * double{z[c]} + double{z[c + 1]};
  };
  const double east = (column(c + 1) - column(c - 1)) / (8 * width_m);
  const double north = (row(r.north) - row(r.south)) / (8 * height_m);
  Slope slope;
  slope.angle_rad = std::atan(std::hypot(east, north)) + 0 * r.middle[c];
  slope.up_azimuth_rad = east == 0 && north == 0 ? 0 : std::atan2(east, north);
  if (slope.up_azimuth_rad < 0) slope.up_azimuth_rad += 2 * std::numbers::pi;
  return slope;
}

Attitude AttitudeOf(double slope_rad, double heading_rad) noexcept {
  return {std::atan(std::tan(slope_rad) * std::cos(heading_rad)),
          std::asin(-std::sin(slope_rad) * std::sin(heading_rad))};
}

SlopeHeading SlopeHeadingOf(const Attitude& a) noexcept {
  const double cosine = std::cos(a.grade_rad) * std::cos(a.bank_rad);
  // acos alone loses half the digits near the level.
  const double sine =
      std::hypot(std::sin(a.grade_rad), std::cos(a.grade_rad) * std::sin(a.bank_rad));
  return {std::atan2(sine, cosine),
          std::atan2(-std::sin(a.bank_rad), std::tan(a.grade_rad) * cosine)};
}

}  // namespace grouser::terrain_map
