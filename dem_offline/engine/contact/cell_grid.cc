#include "dem_offline/engine/contact/cell_grid.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace grouser::dem {
namespace {

constexpr double kPeriod = 4294967296.0;  // 2^32

int PeriodicCell(std::int32_t v, int n) {
  return static_cast<int>((static_cast<std::uint64_t>(static_cast<std::uint32_t>(v)) * n) >> 32);
}

}  // namespace

CellGrid::CellGrid(const std::vector<Grain>& grains, std::int64_t count, const Frame& frame,
                   double cell_m) {
  if (!(frame.length_m / cell_m >= 3 && frame.width_m / cell_m >= 3)) {
    throw std::invalid_argument(
        "bed: " + std::to_string(frame.length_m) + " x " + std::to_string(frame.width_m) +
        " m, expected at least 3 search radii of " + std::to_string(cell_m) + " m each way");
  }
  // Few grains in a wide frame need no more cells than there are grains.
  const double most = 8 + std::sqrt(static_cast<double>(count));
  nx_ = static_cast<int>(std::min(frame.length_m / cell_m, 4 * most));
  ny_ = static_cast<int>(std::min(frame.width_m / cell_m, 4 * most));
  std::int64_t low = 0, high = 0;
  for (std::int64_t i = 0; i < count; ++i) {
    low = i == 0 ? grains[i].z : std::min<std::int64_t>(low, grains[i].z);
    high = i == 0 ? grains[i].z : std::max<std::int64_t>(high, grains[i].z);
  }
  z_low_ = low;
  const double tall = static_cast<double>(high - low) * (frame.z_span_m / kPeriod);
  z_scale_ = frame.z_span_m / kPeriod / std::max(cell_m, tall / (4 * most));
  nz_ = static_cast<int>(static_cast<double>(high - low) * z_scale_) + 1;
  first_.assign(static_cast<std::size_t>(nx_) * ny_ * nz_ + 1, 0);
  std::vector<std::int32_t> cell(count);
  for (std::int64_t i = 0; i < count; ++i) {
    cell[i] = Index(CellX(grains[i].x), CellY(grains[i].y), CellZ(grains[i].z));
    ++first_[cell[i] + 1];
  }
  for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
  order_.resize(count);
  std::vector<std::int32_t> next(first_.begin(), first_.end() - 1);
  for (std::int64_t i = 0; i < count; ++i) order_[next[cell[i]]++] = static_cast<std::int32_t>(i);
}

int CellGrid::CellX(std::int32_t x) const { return PeriodicCell(x, nx_); }
int CellGrid::CellY(std::int32_t y) const { return PeriodicCell(y, ny_); }
int CellGrid::CellZ(std::int32_t z) const {
  return std::clamp(static_cast<int>(static_cast<double>(z - z_low_) * z_scale_), 0, nz_ - 1);
}

}  // namespace grouser::dem
