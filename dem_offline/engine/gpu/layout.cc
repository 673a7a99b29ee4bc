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

std::vector<std::int32_t> WorldOfTile(const Layout& l) { return Owners(l.first, kTile); }
std::vector<std::int32_t> WorldOfCell(const Layout& l) { return Owners(l.first_cell, 1); }
std::vector<std::int32_t> BodyOfTile(const Layout& l) { return Owners(l.first_tile, 1); }
std::vector<std::int32_t> BodyOfRun(const Layout& l) { return Owners(l.first_entry, kRun); }

}  // namespace grouser::dem::gpu
