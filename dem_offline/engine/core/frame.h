#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "dem_offline/engine/core/grain.h"

namespace grouser::dem {

/// Periods and quanta of a world. x and y are periodic with `length_m` and
/// `width_m` (2^32 quanta each); z is not, but shares the integer form.
struct Frame {
  double length_m = 0, width_m = 0, z_span_m = 0;
  std::array<float, 3> Quantum() const;  ///< [m]
  std::int32_t FixX(double x_m) const;   ///< wraps
  std::int32_t FixY(double y_m) const;
  std::int32_t FixZ(double z_m) const;  ///< throws std::out_of_range outside +-z_span/2
};

/// Fixed point of a coordinate that wraps, and of one within half a span of 0.
GROUSER_HD std::int32_t WrapFix(double value_m, double period_m) {
  const double turns = value_m / period_m;
  const double quanta = (turns - floor(turns)) * 4294967296.0;
  return static_cast<std::int32_t>(
      static_cast<std::uint32_t>(static_cast<std::uint64_t>(quanta) & 0xffffffffu));
}
GROUSER_HD std::int32_t SpanFix(double value_m, double span_m) {
  return static_cast<std::int32_t>(llround(value_m / span_m * 4294967296.0));
}

/// a - b, the shorter way round the period.
GROUSER_HD std::int32_t WrapDiff(std::int32_t a, std::int32_t b) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) - static_cast<std::uint32_t>(b));
}

/// Place a from place b [m] (grains, or what else has x, y, z), the nearest image; q: quanta [m].
template <class A, class B>
GROUSER_HD Vec3f Apart(const A& a, const B& b, const float* q) {
  return {static_cast<float>(WrapDiff(a.x, b.x)) * q[0],
          static_cast<float>(WrapDiff(a.y, b.y)) * q[1],
          static_cast<float>(WrapDiff(a.z, b.z)) * q[2]};
}

}  // namespace grouser::dem
