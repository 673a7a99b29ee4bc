#pragma once

#include "dem_offline/engine/core/displacement_bound.h"
#include "dem_offline/engine/gpu/ensemble_view.h"

// Index bodies of the lists. All do nothing for worlds whose lists still last.

namespace grouser::dem::gpu {

/// Adds 1; returns what was there. The order of calls does not show in results.
GROUSER_HD std::int32_t Count(std::int32_t* at) {
#if defined(__CUDA_ARCH__)
  return atomicAdd(at, 1);
#else
  return (*at)++;
#endif
}
GROUSER_HD void Raise(std::int32_t* at, std::int32_t bits) {
#if defined(__CUDA_ARCH__)
  atomicOr(at, bits);
#else
  *at |= bits;
#endif
}

GROUSER_HD int CellAlong(std::int32_t v, int n) {
  return static_cast<int>((static_cast<std::uint64_t>(static_cast<std::uint32_t>(v)) * n) >> 32);
}
/// Grains above and below all cells are put in the outermost.
GROUSER_HD int CellUp(const WorldView& w, std::int32_t z) {
  const double c = static_cast<double>(static_cast<std::int64_t>(z) - w.z_low) * w.z_scale;
  return c < 0 ? 0 : (c >= w.nz ? w.nz - 1 : static_cast<int>(c));
}
GROUSER_HD std::int64_t CellIndex(const WorldView& w, int x, int y, int z) {
  return w.first_cell + (static_cast<std::int64_t>(x) * w.ny + y) * w.nz + z;
}
GROUSER_HD int Around(int c, int n) { return c < 0 ? c + n : (c >= n ? c - n : c); }

/// A world that has failed, whose lists overflowed, or that has come to its last
/// step, stays where it is.
GROUSER_HD bool Waits(const WorldState& s) {
  return s.fault != 0 || s.overflow != 0 || s.steps >= s.until;
}
/// The same for bodies, whose own faults are raised while others still read.
GROUSER_HD bool BodiesWait(const WorldState& s) {
  return (s.fault & ~(kThroughBody | kBodyAway)) != 0 || s.halted || s.overflow ||
         s.steps >= s.until;
}

/// A grain's world and its place there; -1: padding.
struct Member {
  std::int32_t world, place;
};
GROUSER_HD Member MemberAt(const EnsembleView& v, std::int64_t i) {
  const std::int32_t w = v.world_of_tile[i / kTile];
  const std::int64_t place = i - v.worlds[w].first;
  return {w, place < v.worlds[w].count ? static_cast<std::int32_t>(place) : -1};
}

struct BoundDisplacements {
  EnsembleView v;
  bool after_search;
  GROUSER_HD void operator()(std::int64_t i) const {
    const Member m = MemberAt(v, i);
    WorldState& s = v.states[m.world];
    if (m.place < 0 || !s.stale || s.fault || (after_search && !s.search)) return;
    const WorldView& w = v.worlds[m.world];
    const Found at = v.found[i];
    if (!BoundGrain(v.grain[i], at.x, at.y, at.z, w.drift.quantum, w.half_skin, w.room, &v.bound[i],
                    &v.reach[i])) {
      Raise(&s.search, 1);
    }
  }
};

struct ClearCell {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t c) const {
    const WorldState& s = v.states[v.world_of_cell[c]];
    if (s.search && !s.fault) v.cell_count[c] = 0;
  }
};

struct FillCell {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t i) const {
    const Member m = MemberAt(v, i);
    WorldState& s = v.states[m.world];
    if (m.place < 0 || !s.search || s.fault) return;
    const WorldView& w = v.worlds[m.world];
    const Grain& g = v.grain[i];
    const std::int64_t c = CellIndex(w, CellAlong(g.x, w.nx), CellAlong(g.y, w.ny), CellUp(w, g.z));
    const std::int32_t slot = Count(&v.cell_count[c]);
    if (slot < v.cell_slots) {
      v.cell_items[c * v.cell_slots + slot] = m.place;
    } else {
      Raise(&s.overflow, kCellsFull);
    }
    v.found[i] = {g.x, g.y, g.z};
  }
};

/// All neighbours of a grain within the search reach, by gap, then by height
/// between the centres: sums in that order depend neither on the place in
/// memory nor on the order of the cells.
struct FindOuter {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t i) const {
    const Member m = MemberAt(v, i);
    WorldState& s = v.states[m.world];
    if (m.place < 0 || !s.search || s.fault || s.overflow) return;
    const WorldView& w = v.worlds[m.world];
    const Grain g = v.grain[i];
    const std::int32_t clump = v.clump_of ? v.clump_of[i] : -1;
    const int cx = CellAlong(g.x, w.nx), cy = CellAlong(g.y, w.ny), cz = CellUp(w, g.z);
    float gap[kMostOuter], up[kMostOuter];
    std::int32_t found[kMostOuter];
    int n = 0;
    const int low = cz > 0 ? cz - 1 : 0, high = cz + 1 < w.nz ? cz + 1 : w.nz - 1;
    for (int k = 0; k < 9 * (high - low + 1); ++k) {
      const std::int64_t c =
          CellIndex(w, Around(cx + k % 3 - 1, w.nx), Around(cy + k / 3 % 3 - 1, w.ny), low + k / 9);
      for (int o = 0; o < v.cell_count[c]; ++o) {
        const std::int32_t j = v.cell_items[c * v.cell_slots + o];
        if (j == m.place) continue;
        const Grain& h = v.grain[w.first + j];
        if (g.kind & h.kind & kFrozen) continue;
        if (clump >= 0 && clump == v.clump_of[w.first + j]) continue;
        const Vec3f apart = Apart(g, h, w.drift.quantum);
        const float d2 = Dot(apart, apart);
        const float sum = g.radius + h.radius, most = sum + w.search_reach;
        if (!(d2 < most * most)) continue;
        if (n == kMostOuter || n == v.outer_slots) {
          Raise(&s.overflow, kOuterFull);
          return;
        }
        const float open = Sqrt(d2) - sum, rise = apart.z < 0 ? -apart.z : apart.z;
        int at = n++;
        for (; at > 0 && (open < gap[at - 1] ||
                          (open == gap[at - 1] &&
                           (rise < up[at - 1] || (rise == up[at - 1] && j < found[at - 1]))));
             --at) {
          gap[at] = gap[at - 1];
          up[at] = up[at - 1];
          found[at] = found[at - 1];
        }
        gap[at] = open;
        up[at] = rise;
        found[at] = j;
      }
    }
    v.outer_count[i] = n;
    for (int k = 0; k < n; ++k) v.outer_partner[EnsembleView::At(i, k, v.outer_slots)] = found[k];
  }
};

/// Outer neighbours that can touch while both keep within their displacement bounds; histories
/// come along from the list before.
struct PruneInner {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t i) const {
    const Member m = MemberAt(v, i);
    WorldState& s = v.states[m.world];
    if (m.place < 0 || !s.stale || s.fault || s.overflow) return;
    const WorldView& w = v.worlds[m.world];
    const std::int32_t was_own = v.was ? v.was[i] : m.place;
    const std::int64_t row = w.first + was_own;
    const int from = s.turn, to = 1 - s.turn, old = v.inner_count[from][row];
    const Grain g = v.grain[i];
    int n = 0;
    for (int k = 0; k < v.outer_count[i]; ++k) {
      const std::int32_t j = v.outer_partner[EnsembleView::At(i, k, v.outer_slots)];
      const Vec3f apart = Apart(g, v.grain[w.first + j], w.drift.quantum);
      const float d2 = Dot(apart, apart);
      // The lower place first: both sides round alike.
      const float own = v.reach[i], its = v.reach[w.first + j];
      const float limit = (m.place < j ? own + its : its + own) + w.range;
      if (!(d2 < limit * limit)) continue;
      if (n == v.inner_slots) {
        Raise(&s.overflow, kInnerFull);
        return;
      }
      const std::int32_t was_its = v.was ? v.was[w.first + j] : j;
      const bool swapped = (m.place < j) != (was_own < was_its);
      int was = 0;
      while (was < old &&
             v.inner_partner[from][EnsembleView::At(row, was, v.inner_slots)] != was_its) {
        ++was;
      }
      for (int word = 0; word < v.words; ++word) {
        float value = 0.0f;
        if (was < old) {
          value =
              v.history[from][EnsembleView::At(row, was * v.words + word, v.inner_slots * v.words)];
        }
        if (swapped && (v.layout.vector_words >> word & 1u) != 0) value = -value;
        v.history[to][EnsembleView::At(i, n * v.words + word, v.inner_slots * v.words)] = value;
      }
      v.inner_partner[to][EnsembleView::At(i, n, v.inner_slots)] = j;
      ++n;
    }
    v.inner_count[to][i] = n;
  }
};

/// Index body: a world; its lists are new.
struct Settle {
  EnsembleView v;
  GROUSER_HD void operator()(std::int64_t w) const {
    WorldState& s = v.states[w];
    if (!s.stale || s.fault || s.overflow) return;
    s.turn = 1 - s.turn;
    s.rebuilds += s.search;
    ++s.prunes;
    s.stale = s.search = 0;
  }
};

}  // namespace grouser::dem::gpu
