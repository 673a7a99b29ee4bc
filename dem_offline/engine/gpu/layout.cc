#include "dem_offline/engine/gpu/layout.h"

#include <algorithm>

namespace grouser::dem::gpu {
namespace {

/// 0, a, a + b, ...: of f(k), k < n.
template <class F>
std::vector<std::int64_t> Sums(std::size_t n, F&& f) {
  std::vector<std::int64_t> out(1, 0);
  for (std::size_t k = 0; k < n; ++k) out.push_back(out.back() + f(k));
  return out;
}

std::vector<std::int32_t> Owners(const std::vector<std::int64_t>& first, std::int64_t step) {
  std::vector<std::int32_t> out;
  for (std::size_t k = 0; k + 1 < first.size(); ++k) {
    out.insert(out.end(), (first[k + 1] - first[k]) / step, static_cast<std::int32_t>(k));
  }
  return out;
}

}  // namespace

void Layout::Place() {
  first = Sums(tiles.size(), [&](std::size_t w) { return std::int64_t{tiles[w]} * kTile; });
  first_cell = Sums(cells.size(), [&](std::size_t w) { return cells[w]; });
  first_entry = Sums(bodies.size(), [&](std::size_t b) { return std::int64_t{entries[b]}; });
  first_slot =
      Sums(bodies.size(), [&](std::size_t b) { return std::int64_t{entries[b]} * per_grain[b]; });
  first_tile =
      Sums(bodies.size(), [&](std::size_t b) { return std::int64_t{tiles[bodies[b].world]}; });
}

std::int64_t Layout::RoundEntry(int r) const {
  std::size_t b = 0;
  while (b < bodies.size() && bodies[b].number < r) ++b;
  return first_entry[b];
}

std::int64_t ElementsOf(const Extent& extent, const Layout& l, int words) {
  const auto count = [&]() -> std::int64_t {
    switch (extent.of) {
      case Of::kWorld:
        return static_cast<std::int64_t>(l.tiles.size());
      case Of::kTile:
        return l.grains() / kTile;
      case Of::kGrain:
        return l.grains();
      case Of::kClumpGrain:
        return l.clumps > 0 ? l.grains() : 0;
      case Of::kCell:
        return l.all_cells();
      case Of::kClump:
        return l.clumps;
      case Of::kBody:
        return static_cast<std::int64_t>(l.bodies.size());
      case Of::kBodyTile:
        return l.body_tiles();
      case Of::kEntry:
        return l.all_entries();
      case Of::kRun:
        return l.all_entries() / kRun;
      case Of::kSlot:
        return l.slots();
    }
    return 0;
  };
  return count() * extent.Width(l, words);
}

std::vector<std::int64_t> FirstRows(Of of, const Layout& l) {
  if (of == Of::kEntry) return l.first_entry;
  if (of == Of::kSlot) return l.first_slot;
  if (of != Of::kGrain && of != Of::kTile) return {};
  return Sums(l.tiles.size(), [&](std::size_t w) { return std::int64_t{l.tiles[w]}; });
}

std::vector<std::int32_t> WorldOfTile(const Layout& l) { return Owners(l.first, kTile); }
std::vector<std::int32_t> WorldOfCell(const Layout& l) { return Owners(l.first_cell, 1); }
std::vector<std::int32_t> BodyOfTile(const Layout& l) { return Owners(l.first_tile, 1); }
std::vector<std::int32_t> BodyOfRun(const Layout& l) { return Owners(l.first_entry, kRun); }

}  // namespace grouser::dem::gpu
