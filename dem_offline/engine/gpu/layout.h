#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "dem_offline/engine/gpu/ensemble_view.h"

namespace grouser::dem::gpu {

/// Slots of a cell, and of a grain's two lists, to begin with.
struct ListSizes {
  std::int32_t cell_slots = 8, outer_slots = 24, inner_slots = 12;
};

/// Which world and body of it an ensemble's body is.
struct BodyIndex {
  int world = 0, number = 0;
};

/// Where everything of an ensemble lies in its arrays.
struct Layout {
  ListSizes sizes;
  std::vector<std::int32_t> tiles;             ///< [worlds] room of each
  std::vector<std::int64_t> cells;             ///< [worlds]
  std::vector<BodyIndex> bodies;               ///< by number in their worlds, then by world
  std::vector<std::int32_t> entries;           ///< [bodies] room for near grains, whole runs
  std::vector<std::int32_t> per_grain;         ///< [bodies]
  std::int64_t clumps = 0, clump_members = 0;  ///< of all worlds
  // Derived by Place(): sums of the above, one longer.
  std::vector<std::int64_t> first, first_cell;                    ///< [worlds + 1] grains, cells
  std::vector<std::int64_t> first_entry, first_slot, first_tile;  ///< [bodies + 1]

  void Place();
  std::int64_t grains() const { return first.back(); }
  std::int64_t all_cells() const { return first_cell.back(); }
  std::int64_t all_entries() const { return first_entry.back(); }
  std::int64_t slots() const { return first_slot.back(); }
  std::int64_t body_tiles() const { return first_tile.back(); }
  int rounds() const { return bodies.empty() ? 0 : bodies.back().number + 1; }
  /// Entries before round r.
  std::int64_t RoundEntry(int r) const;
};

/// Tiles for so many grains, and a 64th and two more for grains to come.
inline std::int32_t TilesFor(std::int64_t grains) {
  const auto tiles = static_cast<std::int32_t>((grains + kTile - 1) / kTile);
  return tiles + tiles / 64 + 2;
}
/// Entries in whole runs.
inline std::int32_t RunsFor(std::int32_t entries) { return (entries + kRun - 1) / kRun * kRun; }

/// Tables that name the owner of each element.
std::vector<std::int32_t> WorldOfTile(const Layout& layout);
std::vector<std::int32_t> WorldOfCell(const Layout& layout);
std::vector<std::int32_t> BodyOfTile(const Layout& layout);
std::vector<std::int32_t> BodyOfRun(const Layout& layout);

/// Moves an array of grains, `wide_from` elements each, from one layout to another.
template <class T>
std::vector<T> MoveTiles(const std::vector<T>& in, const Layout& from, const Layout& to,
                         std::int64_t wide_from, std::int64_t wide_to) {
  std::vector<T> out(to.grains() * wide_to, T{});
  for (std::size_t w = 0; w < from.tiles.size(); ++w) {
    const std::int64_t tiles = std::min(from.tiles[w], to.tiles[w]);
    for (std::int64_t t = 0; t < tiles; ++t) {
      std::copy_n(in.begin() + (from.first[w] + t * kTile) * wide_from,
                  std::min(wide_from, wide_to) * kTile,
                  out.begin() + (to.first[w] + t * kTile) * wide_to);
    }
  }
  return out;
}

/// The same of one element a tile.
template <class T>
std::vector<T> MoveWhole(const std::vector<T>& in, const Layout& from, const Layout& to) {
  std::vector<T> out(to.grains() / kTile, T{});
  for (std::size_t w = 0; w < from.tiles.size(); ++w) {
    std::copy_n(in.begin() + from.first[w] / kTile, std::min(from.tiles[w], to.tiles[w]),
                out.begin() + to.first[w] / kTile);
  }
  return out;
}

/// The same of what belongs to bodies; first_*: of each body, `wide` elements each.
template <class T>
std::vector<T> MoveBodies(const std::vector<T>& in, const std::vector<std::int64_t>& first_from,
                          const std::vector<std::int64_t>& first_to, std::int64_t wide) {
  std::vector<T> out(first_to.back() * wide, T{});
  for (std::size_t b = 0; b + 1 < first_from.size(); ++b) {
    const std::int64_t n =
        std::min(first_from[b + 1] - first_from[b], first_to[b + 1] - first_to[b]);
    std::copy_n(in.begin() + first_from[b] * wide, n * wide, out.begin() + first_to[b] * wide);
  }
  return out;
}

}  // namespace grouser::dem::gpu
