#pragma once

#include <cstdint>
#include <vector>

#include "dem_offline/engine/core/frame.h"
#include "dem_offline/engine/core/grain.h"

namespace grouser::dem {

/// Grid of cells over a world; also gives the spatial order of grains.
class CellGrid {
 public:
  /// Throws std::invalid_argument when a period is under three cells.
  CellGrid(const std::vector<Grain>& grains, std::int64_t count, const Frame& frame, double cell_m);
  /// Calls f(from, to) for runs of `order` that hold, each once, every grain
  /// of the 27 cells around g.
  template <class F>
  void ForRunsNear(const Grain& g, F&& f) const {
    const int cx = CellX(g.x), cy = CellY(g.y), cz = CellZ(g.z);
    const int low = cz > 0 ? cz - 1 : 0, high = cz + 1 < nz_ ? cz + 1 : nz_ - 1;
    for (int dx = -1; dx <= 1; ++dx) {
      const int x = Around(cx + dx, nx_);
      for (int dy = -1; dy <= 1; ++dy) {
        const int y = Around(cy + dy, ny_);
        f(first_[Index(x, y, low)], first_[Index(x, y, high) + 1]);
      }
    }
  }
  /// Grains cell by cell.
  const std::vector<std::int32_t>& order() const { return order_; }

 private:
  static int Around(int c, int n) { return c < 0 ? c + n : c >= n ? c - n : c; }
  int CellX(std::int32_t x) const;
  int CellY(std::int32_t y) const;
  int CellZ(std::int32_t z) const;
  int Index(int x, int y, int z) const { return (x * ny_ + y) * nz_ + z; }

  int nx_, ny_, nz_;
  double z_scale_;
  std::int64_t z_low_;
  std::vector<std::int32_t> first_, order_;
};

}  // namespace grouser::dem
