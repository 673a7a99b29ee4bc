#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dem_offline/engine/contact/cell_grid.h"
#include "dem_offline/engine/contact/pair_kernel.h"

namespace grouser::dem {

/// Pairs that never make a contact: members of one clump, intact bonds that replace it.
struct Exclusions {
  const std::int32_t* clump_of = nullptr;  ///< [grains]; -1: none. Null: no clumps
  /// [grains] sorted partners behind an intact bond. Null: no bonds
  const std::vector<std::vector<std::int32_t>>* bonded = nullptr;
  bool Has(std::int32_t i, std::int32_t j) const;
};

/// Verlet lists in two stages, each pair once, the grain of the lower place first.
/// The outer list comes from a search through cells and lasts long. The inner list,
/// which the kernel evaluates, is pruned from it, in its order, whenever a grain has
/// reached its displacement bound. The history of a pair is kept with the inner list
/// where the pair is in it, and otherwise, inactive, with the outer list; both survive
/// every renewal.
class PairList {
 public:
  /// words: of one contact's history; vector_words: bits of those that change
  /// sign where the two grains swap. capacity: pairs to begin with; 0: as many
  /// as the first search needs and a quarter more.
  void Configure(int words, unsigned vector_words, std::int64_t capacity);

  /// Search: all pairs closer than `reach_m` (surface to surface) but those of
  /// two frozen grains; the inner list is empty until the next Prune. Where the pairs outgrow
  /// their capacity it is regrown: no history is lost. `place_of`: where the grains of the old list
  /// are now (-1: gone); null: where they were. Throws std::invalid_argument when a period is under
  /// three search radii.
  void Build(const std::vector<Grain>& grains, std::int64_t count, const Frame& frame,
             float reach_m, const Exclusions& excluded = {},
             const std::vector<std::int32_t>* place_of = nullptr);
  /// Inner list: outer pairs closer than the reaches of both and `range_m` together
  /// (centre to centre) that are not both frozen.
  void Prune(const std::vector<Grain>& grains, const std::vector<float>& reaches,
             const Frame& frame, float range_m);

  /// Puts a history, as `grain` sees it, to an existing pair of which a grain moves;
  /// false: no such pair. For use between Build and Prune.
  bool SetHistory(std::int32_t grain, std::int32_t partner, const float* words);

  /// No pair has a history, but for those of two frozen grains.
  void Forget();

  /// The list's part of what the kernels need.
  void Fill(PairView& view);
  std::int64_t blocks() const { return (inner_pairs() + kLanes - 1) / kLanes; }

  int words() const { return words_; }
  std::int64_t pairs() const { return static_cast<std::int64_t>(outer_second_.size()); }
  std::int64_t inner_pairs() const { return static_cast<std::int64_t>(outer_of_.size()); }
  std::uint64_t regrowths() const { return regrowths_; }
  std::int32_t first(std::int64_t inner) const {
    return blocks_[inner / kLanes].first[inner % kLanes];
  }
  std::int32_t second(std::int64_t inner) const {
    return blocks_[inner / kLanes].second[inner % kLanes];
  }
  /// See PairView; all zero where there is no contact.
  const std::vector<float>& history() const { return history_; }
  /// f(i, j, words) for every pair with a history, words as i (< j) sees it.
  template <class F>
  void ForEachHistory(F&& f) const {
    float words[kMaxHistoryWords];
    for (std::int64_t p = 0; p < pairs(); ++p) {
      if (Read(p, words)) f(outer_first_[p], outer_second_[p], static_cast<const float*>(words));
    }
    const float* word = frozen_history_.data();
    for (const auto& [i, j] : frozen_pairs_) {
      f(i, j, word);
      word += words_;
    }
  }

 private:
  std::int64_t Word(std::int64_t inner, int w) const {
    return (inner / kLanes * words_ + w) * kLanes + inner % kLanes;
  }
  bool Read(std::int64_t pair, float* words) const;
  std::int64_t Find(std::int32_t i, std::int32_t j) const;
  void Search(const std::vector<Grain>& grains, std::int64_t count, const Frame& frame,
              float reach_m, const Exclusions& excluded);
  void Carry(const PairList& old, const std::vector<Grain>& grains,
             const std::vector<std::int32_t>* place_of);
  void OrderSides(const std::vector<Grain>& grains, const Frame& frame);
  void FillBlocks(std::size_t grains);

  int words_ = 0;
  unsigned vector_words_ = 0;
  std::int64_t capacity_ = 0;
  std::uint64_t regrowths_ = 0;
  // Outer pairs, by their first grain.
  std::vector<std::int64_t> start_;  ///< [grains + 1]
  std::vector<std::int32_t> outer_first_, outer_second_;
  std::vector<std::int32_t> inner_of_;   ///< [pairs] place in the inner list; -1: not in it
  std::vector<float> inactive_history_;  ///< [pairs x words] of those not in the inner list
  /// 2 x pair, + 1: of its second grain; those of a grain together, by gap.
  std::vector<std::int32_t> sides_;
  std::vector<std::int32_t> side_start_;                   ///< [grains + 1]
  std::vector<std::array<std::int32_t, 2>> frozen_pairs_;  ///< frozen pairs with a history, i < j
  std::vector<float> frozen_history_;
  // Inner pairs.
  std::vector<std::int32_t> outer_of_;  ///< [inner pairs]
  std::vector<PairBlock> blocks_;
  std::vector<float> history_, old_history_;
  std::vector<std::int32_t> old_inner_of_;
  std::vector<std::int32_t> record_start_;  ///< [grains + 1]
  std::vector<GrainLoad> records_;
};

}  // namespace grouser::dem
