#include "dem_offline/engine/contact/neighbour_list.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace grouser::dem {
namespace {

constexpr double kPeriod = 4294967296.0;  // 2^32

std::int32_t Wrap(double value_m, double period_m) {
  const double turns = value_m / period_m;
  const double frac = turns - std::floor(turns);
  return static_cast<std::int32_t>(
      static_cast<std::uint32_t>(static_cast<std::uint64_t>(frac * kPeriod) & 0xffffffffu));
}

float Diff(std::int32_t a, std::int32_t b, float q) {
  return static_cast<float>(static_cast<std::int32_t>(static_cast<std::uint32_t>(a) -
                                                      static_cast<std::uint32_t>(b))) * q;
}

int PeriodicCell(std::int32_t v, int n) {
  return static_cast<int>((static_cast<std::uint64_t>(static_cast<std::uint32_t>(v)) * n) >> 32);
}

struct Candidate {
  float gap;
  std::int32_t j;
  bool operator<(const Candidate& o) const { return gap != o.gap ? gap < o.gap : j < o.j; }
};

}  // namespace

std::array<float, 3> Frame::Quantum() const {
  return {static_cast<float>(length_m / kPeriod), static_cast<float>(width_m / kPeriod),
          static_cast<float>(z_span_m / kPeriod)};
}
std::int32_t Frame::FixX(double x_m) const { return Wrap(x_m, length_m); }
std::int32_t Frame::FixY(double y_m) const { return Wrap(y_m, width_m); }
std::int32_t Frame::FixZ(double z_m) const {
  if (!(std::abs(z_m) < 0.5 * z_span_m)) {
    throw std::out_of_range("z: " + std::to_string(z_m) + " m, expected within +-" +
                            std::to_string(0.5 * z_span_m) + " m");
  }
  return static_cast<std::int32_t>(std::llround(z_m / z_span_m * kPeriod));
}

bool Exclusions::Has(std::int32_t i, std::int32_t j) const {
  if (clump_of && clump_of[i] >= 0 && clump_of[i] == clump_of[j]) return true;
  return bonded && std::binary_search((*bonded)[i].begin(), (*bonded)[i].end(), j);
}

CellGrid::CellGrid(const std::vector<Grain>& grains, std::int64_t count, const Frame& frame,
                   double cell_m) {
  if (!(frame.length_m / cell_m >= 3 && frame.width_m / cell_m >= 3)) {
    throw std::invalid_argument("bed: " + std::to_string(frame.length_m) + " x " +
                                std::to_string(frame.width_m) +
                                " m, expected at least 3 search radii of " +
                                std::to_string(cell_m) + " m each way");
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

void NeighbourList::Configure(int words, std::int64_t capacity) {
  words_ = words;
  capacity_ = capacity;
}

/// Candidates of one tile after another, written into slots of fixed capacity.
struct NeighbourList::Slots {
  std::int64_t capacity, needed = 0;
  std::vector<std::int64_t> first;
  std::vector<std::int32_t> partner;

  void Add(std::int64_t tile, const std::array<std::vector<Candidate>, kLanes>& found) {
    std::size_t rows = 0;
    for (const auto& f : found) rows = std::max(rows, f.size());
    const std::int64_t base = needed;
    needed += static_cast<std::int64_t>(rows) * kLanes;
    first[tile + 1] = needed;
    if (needed > capacity) return;  // counted to the end, so that one regrowth suffices
    for (std::size_t k = 0; k < rows; ++k) {
      for (int l = 0; l < kLanes; ++l) {
        partner[base + k * kLanes + l] = k < found[l].size()
                                             ? found[l][k].j
                                             : static_cast<std::int32_t>(tile * kLanes + l);
      }
    }
  }
};

void NeighbourList::Build(const std::vector<Grain>& grains, std::int64_t count,
                          const Frame& frame, float reach_m, const Exclusions& excluded) {
  const auto tiles = static_cast<std::int64_t>(grains.size()) / kLanes;
  if (count == 0) {
    first_slot_.assign(tiles + 1, 0);
    return;
  }
  float largest = 0;
  for (std::int64_t i = 0; i < count; ++i) largest = std::max(largest, grains[i].radius);
  const auto q = frame.Quantum();
  const CellGrid grid(grains, count, frame, 2.0 * largest + reach_m);
  const auto fill = [&](Slots& slots) {
    std::array<std::vector<Candidate>, kLanes> found;
    for (std::int64_t t = 0; t < tiles; ++t) {
      for (int l = 0; l < kLanes; ++l) {
        found[l].clear();
        const std::int64_t i = t * kLanes + l;
        if (i >= count) continue;
        const Grain& g = grains[i];
        grid.ForNear(g, [&](std::int32_t j) {
          if (j == i) return;
          const Grain& o = grains[j];
          const float dx = Diff(g.x, o.x, q[0]), dy = Diff(g.y, o.y, q[1]),
                      dz = Diff(g.z, o.z, q[2]);
          const float touch = g.radius + o.radius, far = touch + reach_m;
          const float d2 = dx * dx + dy * dy + dz * dz;
          if (d2 >= far * far || excluded.Has(static_cast<std::int32_t>(i), j)) return;
          found[l].push_back({std::sqrt(d2) - touch, j});
        });
        std::sort(found[l].begin(), found[l].end());
      }
      slots.Add(t, found);
    }
  };
  for (;;) {
    Slots slots{capacity_, 0, std::vector<std::int64_t>(tiles + 1, 0),
                std::vector<std::int32_t>(capacity_)};
    fill(slots);
    if (slots.needed > capacity_) {  // this list is still the old one: nothing to undo
      if (capacity_ > 0) ++regrowths_;
      capacity_ = (slots.needed + slots.needed / 4 + kLanes) / kLanes * kLanes;
      continue;
    }
    NeighbourList old;
    std::swap(old, *this);
    words_ = old.words_;
    capacity_ = old.capacity_;
    regrowths_ = old.regrowths_;
    first_slot_ = std::move(slots.first);
    partner_ = std::move(slots.partner);
    partner_.resize(slots.needed);
    for (int w = 0; w < words_; ++w) history_[w].assign(partner_.size(), 0.0f);
    row_touches_.assign(partner_.size() / kLanes, 0);
    if (!old.partner_.empty()) Carry(old, tiles);
    return;
  }
}

bool NeighbourList::Alive(std::int64_t slot) const {
  for (int w = 0; w < words_; ++w) {
    if (history_[w][slot] != 0.0f) return true;
  }
  return false;
}

void NeighbourList::Carry(const NeighbourList& old, std::int64_t tiles) {
  for (std::int64_t t = 0; t < tiles; ++t) {
    for (std::int64_t s = old.first_slot_[t]; s < old.first_slot_[t + 1]; ++s) {
      if (!old.row_touches_[s / kLanes] || !old.Alive(s)) continue;
      float words[kMaxHistoryWords];
      for (int w = 0; w < words_; ++w) words[w] = old.history_[w][s];
      SetHistory(static_cast<std::int32_t>(t * kLanes + s % kLanes), old.partner_[s], words);
    }
  }
}

bool NeighbourList::SetHistory(std::int32_t grain, std::int32_t partner, const float* words) {
  const int t = grain / kLanes, l = grain % kLanes;
  for (std::int64_t s = first_slot_[t] + l; s < first_slot_[t + 1]; s += kLanes) {
    if (partner_[s] != partner) continue;
    for (int w = 0; w < words_; ++w) history_[w][s] = words[w];
    row_touches_[s / kLanes] = 1;
    return true;
  }
  return false;
}

}  // namespace grouser::dem
