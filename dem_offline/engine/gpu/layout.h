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

/// What an array has elements of: so many each (slots of ListSizes, words of a history).
enum class Of {
  kWorld,
  kTile,
  kGrain,
  kClumpGrain,
  kCell,
  kClump,
  kBody,
  kBodyTile,
  kEntry,
  kRun,
  kSlot
};
struct Extent {
  Of of;
  std::int32_t ListSizes::*slots = nullptr;
  bool words = false;
  std::int64_t Width(const Layout& l, int history_words) const {
    return std::int64_t{slots ? l.sizes.*slots : 1} * (words ? history_words : 1);
  }
};

/// Elements of an array; words: of one contact's history.
std::int64_t ElementsOf(const Extent& extent, const Layout& layout, int words);

/// Where the rows begin that belong to each world or body; what has as many elements in
/// every layout has none.
std::vector<std::int64_t> FirstRows(Of of, const Layout& layout);

/// An array of one layout as it is in another: what fits of every row.
template <class T>
std::vector<T> Moved(const std::vector<T>& in, const Extent& extent, const Layout& from,
                     const Layout& to, int words) {
  const std::vector<std::int64_t> old_rows = FirstRows(extent.of, from),
                                  new_rows = FirstRows(extent.of, to);
  if (old_rows.empty()) return in;
  const std::int64_t in_row = extent.of == Of::kGrain ? kTile : 1;
  const std::int64_t old_row = in_row * extent.Width(from, words),
                     new_row = in_row * extent.Width(to, words);
  std::vector<T> out(new_rows.back() * new_row, T{});
  for (std::size_t k = 0; k + 1 < old_rows.size(); ++k) {
    const std::int64_t rows =
        std::min(old_rows[k + 1] - old_rows[k], new_rows[k + 1] - new_rows[k]);
    for (std::int64_t r = 0; r < rows; ++r) {
      std::copy_n(in.begin() + (old_rows[k] + r) * old_row, std::min(old_row, new_row),
                  out.begin() + (new_rows[k] + r) * new_row);
    }
  }
  return out;
}

}  // namespace grouser::dem::gpu
