#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "dem_offline/engine/world/world.h"

namespace grouser::dem {

struct FreezerSettings {
  /// Half sizes [m] of the box around the hub, along travel, across, and down
  /// from the hub; grains in it never freeze.
  std::array<double, 3> half_m = {0, 0, 0};
  double ring = 1.1;           ///< active grains stay active in the box times this
  double quiet_m_per_s = 0;    ///< slower, over two looks: may freeze
  double disturb_m_per_s = 0;  ///< an active grain faster than this makes its neighbours active
  double cell_m = 0;           ///< neighbours: in the same or an adjoining cell
};

/// Says which grains rest. Looked at every so many steps, so that equal runs
/// give equal flags. A grain freezes when it is outside the box, moved less
/// than `quiet` times the time over each of two looks, and nothing near it
/// moves; it becomes active when the box reaches it or something near it moves. Speeds
/// are displacements over a look: a grain that trembles in place is quiet.
class Freezer {
 public:
  explicit Freezer(const FreezerSettings& settings) : settings_(settings) {}

  /// Flags by place in memory. `held(i)`: frozen whatever it does (the band of
  /// a window). `look_s`: time since the last look.
  void Look(const World& world, const Vec3d& hub_m, double look_s,
            const std::function<bool(const Grain&)>& held, std::vector<std::uint8_t>* frozen);

 private:
  struct Seen {
    std::int32_t x = 0, y = 0, z = 0;
    std::int16_t looks = -1;  ///< quiet looks in a row; -1: never seen
  };
  enum class Place { kInside, kRing, kOutside };
  struct Grid;

  Place PlaceOf(const World& world, const Grain& g, const Vec3d& hub_m) const;
  double Moved2(const World& world, const Grain& g);

  FreezerSettings settings_;
  std::vector<Seen> seen_;  ///< [id]
};

}  // namespace grouser::dem
