#include "dem_offline/engine/contact/pair_list.h"

#include <algorithm>
#include <cmath>

namespace grouser::dem {
namespace {

/// Positions of a cell's grains next to each other: the search reads nothing else.
struct Packed {
  std::int32_t x, y, z;
  float radius;
  std::int32_t place, kind;
};

std::vector<Packed> Pack(const std::vector<Grain>& grains, const CellGrid& grid) {
  std::vector<Packed> out;
  out.reserve(grid.order().size());
  for (const std::int32_t j : grid.order()) {
    const Grain& g = grains[j];
    out.push_back({g.x, g.y, g.z, g.radius, j, g.kind});
  }
  return out;
}

template <class A, class B>
float Distance2(const A& a, const B& b, const std::array<float, 3>& q) {
  const Vec3f d = Apart(a, b, q.data());
  return Dot(d, d);
}

template <class A, class B>
bool Within(const A& a, const B& b, const std::array<float, 3>& q, float reach_m) {
  const float limit = a.radius + b.radius + reach_m;
  return Distance2(a, b, q) < limit * limit;
}

}  // namespace

bool Exclusions::Has(std::int32_t i, std::int32_t j) const {
  if (clump_of && clump_of[i] >= 0 && clump_of[i] == clump_of[j]) return true;
  return bonded && std::binary_search((*bonded)[i].begin(), (*bonded)[i].end(), j);
}

void PairList::Configure(int words, unsigned vector_words, std::int64_t capacity) {
  words_ = words;
  vector_words_ = vector_words;
  capacity_ = capacity;
}

void PairList::Build(const std::vector<Grain>& grains, std::int64_t count, const Frame& frame,
                     float reach_m, const Exclusions& excluded,
                     const std::vector<std::int32_t>* place_of) {
  PairList old;
  std::swap(old, *this);
  words_ = old.words_;
  vector_words_ = old.vector_words_;
  capacity_ = old.capacity_;
  regrowths_ = old.regrowths_;
  outer_first_.reserve(capacity_);
  outer_second_.reserve(capacity_);
  Search(grains, count, frame, reach_m, excluded);
  if (pairs() > capacity_) {
    if (capacity_ > 0) ++regrowths_;
    capacity_ = pairs() + pairs() / 4 + kLanes;
  }
  inner_of_.assign(pairs(), -1);
  inactive_history_.assign(pairs() * words_, 0.0f);
  OrderSides(grains, frame);
  Carry(old, grains, place_of);
}

void PairList::Search(const std::vector<Grain>& grains, std::int64_t count, const Frame& frame,
                      float reach_m, const Exclusions& excluded) {
  start_.assign(1, 0);
  outer_first_.clear();
  outer_second_.clear();
  if (count == 0) return;
  float largest = 0;
  for (std::int64_t i = 0; i < count; ++i) largest = std::max(largest, grains[i].radius);
  const auto q = frame.Quantum();
  const CellGrid grid(grains, count, frame, 2.0 * largest + reach_m);
  const std::vector<Packed> packed = Pack(grains, grid);
  std::vector<std::int32_t> active = {0};  // up to a place of the cells' order
  active.reserve(packed.size() + 1);
  for (const Packed& o : packed) active.push_back(active.back() + ((o.kind & kFrozen) == 0));
  for (std::int32_t i = 0; i < count; ++i) {
    const Grain& g = grains[i];
    const bool frozen = (g.kind & kFrozen) != 0;
    grid.ForRunsNear(g, [&](std::int32_t from, std::int32_t to) {
      if (frozen && active[from] == active[to]) return;
      for (std::int32_t k = from; k < to; ++k) {
        const Packed& o = packed[k];
        if (o.place <= i || (frozen && (o.kind & kFrozen) != 0)) continue;
        if (!Within(g, o, q, reach_m)) continue;
        if (excluded.Has(i, o.place)) continue;
        outer_first_.push_back(i);
        outer_second_.push_back(o.place);
      }
    });
    start_.push_back(static_cast<std::int64_t>(outer_second_.size()));
  }
}

void PairList::Carry(const PairList& old, const std::vector<Grain>& grains,
                     const std::vector<std::int32_t>* place_of) {
  old.ForEachHistory([&](std::int32_t i, std::int32_t j, const float* words) {
    if (place_of) {
      i = (*place_of)[i];
      j = (*place_of)[j];
    }
    if (i < 0 || j < 0 || SetHistory(i, j, words)) return;
    if (!(grains[i].kind & grains[j].kind & kFrozen)) return;
    frozen_pairs_.push_back({std::min(i, j), std::max(i, j)});
    for (int w = 0; w < words_; ++w) {
      const bool turn = i > j && (vector_words_ >> w & 1u) != 0;
      frozen_history_.push_back(turn ? -words[w] : words[w]);
    }
  });
}

std::int64_t PairList::Find(std::int32_t i, std::int32_t j) const {
  if (i > j) std::swap(i, j);
  if (i + 1 >= static_cast<std::int64_t>(start_.size())) return -1;
  for (std::int64_t p = start_[i]; p < start_[i + 1]; ++p) {
    if (outer_second_[p] == j) return p;
  }
  return -1;
}

bool PairList::SetHistory(std::int32_t grain, std::int32_t partner, const float* words) {
  const std::int64_t p = Find(grain, partner);
  if (p < 0) return false;
  for (int w = 0; w < words_; ++w) {
    const bool turn = grain > partner && (vector_words_ >> w & 1u) != 0;
    const float value = turn ? -words[w] : words[w];
    if (inner_of_[p] >= 0) {
      history_[Word(inner_of_[p], w)] = value;
    } else {
      inactive_history_[p * words_ + w] = value;
    }
  }
  if (inner_of_[p] >= 0) blocks_[inner_of_[p] / kLanes].touched = 1;
  return true;
}

void PairList::Forget() {
  std::fill(inactive_history_.begin(), inactive_history_.end(), 0.0f);
  std::fill(history_.begin(), history_.end(), 0.0f);
}

bool PairList::Read(std::int64_t pair, float* words) const {
  const std::int32_t inner = inner_of_.empty() ? -1 : inner_of_[pair];
  bool alive = false;
  for (int w = 0; w < words_; ++w) {
    words[w] = inner >= 0 ? history_[Word(inner, w)] : inactive_history_[pair * words_ + w];
    alive |= words[w] != 0.0f;
  }
  return alive;
}

/// Sides of each grain by gap: sums in this order do not depend on where grains
/// lie in memory. Those of equal gap go by the height between the centres.
void PairList::OrderSides(const std::vector<Grain>& grains, const Frame& frame) {
  struct Key {
    float gap, dz;
    std::int32_t number;
    bool operator<(const Key& o) const { return gap != o.gap ? gap < o.gap : dz < o.dz; }
  };
  const auto q = frame.Quantum();
  side_start_.assign(grains.size() + 1, 0);
  for (std::int64_t p = 0; p < pairs(); ++p) {
    ++side_start_[outer_first_[p] + 1];
    ++side_start_[outer_second_[p] + 1];
  }
  for (std::size_t g = 0; g < grains.size(); ++g) side_start_[g + 1] += side_start_[g];
  std::vector<std::int32_t> end(side_start_.begin(), side_start_.end() - 1);
  std::vector<Key> keys(2 * pairs());
  const auto insert = [&](std::int32_t grain, const Key& key) {
    std::int32_t at = end[grain]++;
    for (; at > side_start_[grain] && key < keys[at - 1]; --at) keys[at] = keys[at - 1];
    keys[at] = key;
  };
  for (std::int64_t p = 0; p < pairs(); ++p) {
    const Grain &a = grains[outer_first_[p]], &b = grains[outer_second_[p]];
    const float gap = std::sqrt(Distance2(a, b, q)) - (a.radius + b.radius);
    const float dz = std::abs(static_cast<float>(WrapDiff(a.z, b.z)));
    const auto number = static_cast<std::int32_t>(2 * p);
    insert(outer_first_[p], {gap, dz, number});
    insert(outer_second_[p], {gap, dz, number + 1});
  }
  sides_.resize(keys.size());
  for (std::size_t k = 0; k < keys.size(); ++k) sides_[k] = keys[k].number;
}

void PairList::Prune(const std::vector<Grain>& grains, const std::vector<float>& reaches,
                     const Frame& frame, float range_m) {
  const auto q = frame.Quantum();
  std::swap(old_inner_of_, inner_of_);
  std::swap(old_history_, history_);
  inner_of_.resize(pairs());
  history_.resize((pairs() + kLanes) / kLanes * kLanes * words_);
  outer_of_.clear();
  for (std::int64_t p = 0; p < pairs(); ++p) {
    const std::int32_t i = outer_first_[p], j = outer_second_[p], was = old_inner_of_[p];
    const Grain &a = grains[i], &b = grains[j];
    const float limit = reaches[i] + reaches[j] + range_m;
    const bool inner = Distance2(a, b, q) < limit * limit && (a.kind & b.kind & kFrozen) == 0;
    const auto now = static_cast<std::int64_t>(outer_of_.size());
    float* const inactive = &inactive_history_[p * words_];
    inner_of_[p] = inner ? static_cast<std::int32_t>(now) : -1;
    if (inner) outer_of_.push_back(static_cast<std::int32_t>(p));
    if (!inner && was < 0) continue;
    for (int w = 0; w < words_; ++w) {
      float& to = inner ? history_[Word(now, w)] : inactive[w];
      to = was >= 0 ? old_history_[Word(was, w)] : inactive[w];
    }
  }
  history_.resize(blocks() * words_ * kLanes);
  for (std::int64_t c = inner_pairs(); c < blocks() * kLanes; ++c) {
    for (int w = 0; w < words_; ++w) history_[Word(c, w)] = 0.0f;
  }
  FillBlocks(grains.size());
}

void PairList::FillBlocks(std::size_t grains) {
  const auto spare = static_cast<std::int32_t>(2 * inner_pairs());
  records_.resize(spare + 1);  // padding writes past all records that are read
  blocks_.resize(blocks() + kBlocksAhead);
  const auto lanes = static_cast<std::int64_t>(blocks_.size()) * kLanes;
  for (std::int64_t c = 0; c < lanes; ++c) {
    PairBlock& block = blocks_[c / kLanes];
    const auto l = c % kLanes;
    const bool real = c < inner_pairs();
    block.first[l] = real ? outer_first_[outer_of_[c]] : 0;
    block.second[l] = real ? outer_second_[outer_of_[c]] : 0;
    if (!real) block.first_record[l] = block.second_record[l] = spare;
    block.touched = 1;  // the kernel finds out
  }
  record_start_.resize(grains + 1);
  std::int32_t record = 0;
  for (std::size_t g = 0; g < grains; ++g) {
    record_start_[g] = record;
    for (std::int32_t k = side_start_[g]; k < side_start_[g + 1]; ++k) {
      const std::int32_t c = inner_of_[sides_[k] / 2];
      if (c < 0) continue;
      PairBlock& block = blocks_[c / kLanes];
      (sides_[k] % 2 == 0 ? block.first_record : block.second_record)[c % kLanes] = record++;
    }
  }
  record_start_[grains] = record;
}

void PairList::Fill(PairView& view) {
  view.blocks = blocks_.data();
  view.history = history_.data();
  view.record_start = record_start_.data();
  view.records = records_.data();
}

}  // namespace grouser::dem
