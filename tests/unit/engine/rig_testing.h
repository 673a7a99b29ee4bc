#pragma once

#include "dem_offline/engine/rig/wheel_test.h"

namespace grouser::dem {

/// A wheel test of a second: coarse, soft, small.
inline WheelTestSpec Small() {
  WheelTestSpec s;
  s.soil.youngs_modulus_pa = 2e6;
  s.soil.rolling_friction = 0.2;
  s.soil.sizes = {{0.010, 0.5}, {0.012, 0.5}};
  s.wheel.radius_m = 0.04;
  s.wheel.width_m = 0.04;
  s.rig.bed_length_m = 0.20;
  s.rig.bed_width_m = 0.10;
  s.rig.bed_depth_m = 0.05;
  s.rig.max_time_s = 0.8;
  s.state.load_n = 6;
  s.state.slip = 0.3;
  return s;
}

/// Its bed, settled once.
inline const Tile& SmallTile() {
  static const Tile tile = PrepareBed(BedOf(Small()), nullptr);
  return tile;
}

}  // namespace grouser::dem
