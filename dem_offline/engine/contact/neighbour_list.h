#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dem_offline/engine/laws/menu.h"
#include "dem_offline/engine/world/grain.h"

namespace grouser::dem {

/// Periods and quanta of a world. x and y are periodic with `length_m` and
/// `width_m` (2^32 quanta each); z is not, but shares the integer form.
struct Frame {
  double length_m = 0, width_m = 0, z_span_m = 0;
  std::array<float, 3> Quantum() const;  ///< [m]
  std::int32_t FixX(double x_m) const;   ///< wraps
  std::int32_t FixY(double y_m) const;
  std::int32_t FixZ(double z_m) const;   ///< throws std::out_of_range outside +-z_span/2
};

/// Pairs that never make a contact: members of one clump, intact bonds.
struct Exclusions {
  const std::int32_t* clump_of = nullptr;  ///< [grains]; -1: none. Null: no clumps
  /// [grains] sorted partners behind an intact bond. Null: no bonds
  const std::vector<std::vector<std::int32_t>>* bonded = nullptr;
  bool Has(std::int32_t i, std::int32_t j) const;
};

/// Full Verlet lists in interleaved slots (see PairView), with the history of
/// every contact carried over rebuilds by partner.
class NeighbourList {
 public:
  /// words: of one contact's history. capacity: slots to begin with; 0: as
  /// many as the first build needs and a quarter more.
  void Configure(int words, std::int64_t capacity);

  /// Finds all pairs closer than `reach_m` (surface to surface). Candidates of
  /// a grain are ordered by gap, so that touching rows come first. Where the
  /// slots do not suffice the old list stays, the capacity is regrown, and the
  /// build repeated: no history is lost. Throws std::invalid_argument when
  /// the period is under three search radii.
  void Build(const std::vector<Grain>& grains, std::int64_t count, const Frame& frame,
             float reach_m, const Exclusions& excluded = {});

  /// Puts a history into an existing slot (tile restore); false: no such slot.
  bool SetHistory(std::int32_t grain, std::int32_t partner, const float* words);

  int words() const { return words_; }
  const std::vector<std::int64_t>& first_slot() const { return first_slot_; }
  const std::vector<std::int32_t>& partner() const { return partner_; }
  /// [words], each [slots]; word 0 is zero where there is no contact (laws with
  /// range may keep a neck with word 0 zero: look at all words there).
  std::array<std::vector<float>, kMaxHistoryWords>& history() { return history_; }
  const std::array<std::vector<float>, kMaxHistoryWords>& history() const { return history_; }
  std::vector<std::uint8_t>& row_touches() { return row_touches_; }
  std::uint64_t regrowths() const { return regrowths_; }
  std::int64_t capacity() const { return capacity_; }

 private:
  struct Slots;
  bool Alive(std::int64_t slot) const;
  void Carry(const NeighbourList& old, std::int64_t tiles);

  int words_ = 0;
  std::int64_t capacity_ = 0;
  std::uint64_t regrowths_ = 0;
  std::vector<std::int64_t> first_slot_;
  std::vector<std::int32_t> partner_;
  std::array<std::vector<float>, kMaxHistoryWords> history_;
  std::vector<std::uint8_t> row_touches_;
};

/// Grid of cells over a world; also gives the spatial order of grains.
class CellGrid {
 public:
  CellGrid(const std::vector<Grain>& grains, std::int64_t count, const Frame& frame,
           double cell_m);
  /// Calls f(j) for every grain of the 27 cells around grain i, each once.
  template <class F>
  void ForNear(const Grain& g, F&& f) const {
    const int cx = CellX(g.x), cy = CellY(g.y), cz = CellZ(g.z);
    for (int dz = -1; dz <= 1; ++dz) {
      if (cz + dz < 0 || cz + dz >= nz_) continue;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const int c = Index((cx + dx + nx_) % nx_, (cy + dy + ny_) % ny_, cz + dz);
          for (std::int32_t k = first_[c]; k < first_[c + 1]; ++k) f(order_[k]);
        }
      }
    }
  }
  /// Grains cell by cell.
  const std::vector<std::int32_t>& order() const { return order_; }

 private:
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
