#pragma once

#include <cstdint>

#include "dem_offline/engine/core/grain.h"
#include "dem_offline/engine/core/vec3.h"

// The order of grains in memory: shared by World::Sort and a device.

namespace grouser::dem {

/// Columns and layers of two diameters; few grains in a wide frame get fewer.
struct SortGrid {
  std::int32_t nx, ny;
  double layers_per_quantum;
  float smallest;  ///< radius [m]
};

inline constexpr int kSortKeyBits = 46;

/// Sizes by factors of two first, then columns of cells from below: who meets
/// lies close. Grains of equal keys keep their order.
GROUSER_HD std::uint64_t SortKey(const SortGrid& s, const Grain& g) {
  const auto cell = [](std::int32_t v, std::int32_t n) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(v)) *
               static_cast<std::uint64_t>(n) >>
           32;
  };
  std::uint64_t size = 0;
  for (float r = 2 * s.smallest; g.radius >= r && size < 15; r *= 2) ++size;
  const double up = 8192.0 + g.z * s.layers_per_quantum;
  const auto layer = static_cast<std::uint64_t>(up < 0 ? 0 : (up > 16383 ? 16383 : up));
  return size << 42 | cell(g.x, s.nx) << 28 | cell(g.y, s.ny) << 14 | layer;
}

}  // namespace grouser::dem
