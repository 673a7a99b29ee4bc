#pragma once

#include "dem_offline/engine/gpu/list_body.h"

// Index bodies of a sort of memory in the order of space. Lists and histories are not
// moved: the search that follows looks them up where they were (EnsembleView::was).

namespace grouser::dem::gpu {

/// Arrays of a sort. The bits of a key: world, place in space; worlds stay where
/// they are.
struct SortArrays {
  std::uint64_t *key, *key_sorted;     ///< [grains]
  std::int32_t *place, *place_sorted;  ///< [grains] within the world
  const std::uint8_t* wanted;          ///< [worlds]
  const Grain* grain;                  ///< [grains] as they were, as the two below
  const GrainLoad* load;
  const Kinetics* kinetics;
};

/// Padding comes last; grains of a world that is not wanted keep their places.
struct NameKey {
  EnsembleView v;
  SortArrays a;
  GROUSER_HD void operator()(std::int64_t i) const {
    const Member m = MemberAt(v, i);
    const WorldView& w = v.worlds[m.world];
    const std::uint64_t last = (std::uint64_t{1} << kSortKeyBits) - 1;
    std::uint64_t key = last;
    if (m.place >= 0) key = a.wanted[m.world] ? SortKey(w.sort, v.grain[i]) : 0;
    a.key[i] = static_cast<std::uint64_t>(m.world) << kSortKeyBits | key;
    a.place[i] = static_cast<std::int32_t>(i - w.first);
  }
};

struct TakePlace {
  EnsembleView v;
  SortArrays a;
  GROUSER_HD void operator()(std::int64_t i) const {
    const Member m = MemberAt(v, i);
    const WorldView& w = v.worlds[m.world];
    if (m.place < 0 || !a.wanted[m.world]) return;
    const std::int64_t from = w.first + a.place_sorted[i];
    v.grain[i] = a.grain[from];
    v.load[i] = a.load[from];
    w.drift.kinetics[m.place] = a.kinetics[from];
  }
};

/// Index body: a world; its lists are to be searched for.
struct AskSearch {
  EnsembleView v;
  SortArrays a;
  GROUSER_HD void operator()(std::int64_t w) const {
    if (a.wanted[w]) v.states[w].stale = v.states[w].search = 1;
  }
};

/// sort: of keys and what goes with them, stable.
template <class Launch, class Sorter>
void SortGrains(const Launch& launch, const Sorter& sort, const EnsembleView& v,
                const SortArrays& a) {
  launch(v.grains, NameKey{v, a});
  sort(a, v.grains);
  launch(v.grains, TakePlace{v, a});
  launch(v.world_count, AskSearch{v, a});
}

}  // namespace grouser::dem::gpu
