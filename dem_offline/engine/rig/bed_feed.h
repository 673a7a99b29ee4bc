#pragma once

#include <cstdint>
#include <vector>

#include "dem_offline/engine/rig/wheel_test.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {

/// A grain of the endless bed: which grain of the tile, in which copy of it along x.
struct TilePlace {
  std::int32_t grain = -1;
  std::int32_t copy = 0;
  bool operator==(const TilePlace&) const = default;
};

/// A contact of the endless bed with at least one grain in a piece. `in_a`, `in_b`: places in the
/// piece, -1 for the grain that lies outside. `words`: the history, as `a` sees it.
struct BedTouch {
  TilePlace a, b;
  std::int32_t in_a = -1, in_b = -1;
  const float* words = nullptr;
};

/// A contact of a grain of a piece with the floor.
struct FloorTouch {
  std::int32_t in = -1;
  const float* words = nullptr;
};

/// A stretch of the endless bed. Histories point into the tile.
struct BedPiece {
  std::vector<GrainState> grains;      ///< x_m runs on and on: a World wraps it
  std::vector<TilePlace> tile_places;  ///< of each grain
  std::vector<BedTouch> touches;       ///< as the tile has them
  std::vector<FloorTouch> floor;
};

/// The endless bed that periodic tiles make along x: its grains and contacts
/// between any two planes. Copy c of tile grain i stands at x_i + c L: the same
/// number however it is reached, so that pieces side by side share no grain and
/// miss none. The tile must outlive the feed.
class BedFeed {
 public:
  /// words: of one contact's history. Throws std::invalid_argument when the
  /// tile's arrays do not fit each other.
  BedFeed(const Tile& tile, double grain_density_kg_per_m3, int words);

  /// Grains whose centres lie in [from_m, to_m), and every contact they have.
  BedPiece Between(double from_m, double to_m) const;

  double tile_length_m() const { return length_; }
  double XOf(TilePlace place) const;

 private:
  struct Link {
    std::int32_t a, b;   ///< grains of the tile
    std::int32_t shift;  ///< copy of b less copy of a
    const float* words;
  };
  struct Stretch;

  void AddTouches(const Stretch& stretch, std::int32_t grain, std::int32_t copy, std::int32_t place,
                  BedPiece* out) const;

  const Tile& tile_;
  double density_, length_, z_quantum_, y_quantum_;
  std::vector<double> x_;            ///< [grain], in [0, length)
  std::vector<std::int32_t> order_;  ///< grains by x
  std::vector<std::int32_t> rank_;   ///< [grain] place in order_
  std::vector<Link> links_;
  std::vector<std::int32_t> first_link_;  ///< [grains + 1] into link_of_
  std::vector<std::int32_t> link_of_;     ///< links at either end
  std::vector<const float*> floor_;       ///< [grain], null: none
};

}  // namespace grouser::dem
