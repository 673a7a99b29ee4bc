#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <span>

#include "surrogate/vehicle/solver.h"

namespace grouser::vehicle {

/// Finds for each item along a path the highest of the levels 0 to `levels` at which it is good,
/// all levels below a good one taken to be good. An item begins at the level that those before it
/// suggest, from their last solution, and goes on up or down by 1, 1, 2, 4, ... levels, then by
/// halves; sixteen stretches of the path advance together. A solve from a neighbour's solution that
/// does not balance within a few evaluations counts as not good; where the level found is far from
/// the suggested one, that is asked again with all starts.
class LevelSearch {
 public:
  /// One item on its way.
  struct Track {
    std::size_t item = 0, end = 0;
    int low = -1, high = 0;  ///< highest good and lowest failed level until now
    int level = 0, stride = 0, suggested = kNone;
    int before = kNone;                     ///< level of the item before the last
    bool all_starts = false, sure = false;  ///< of this solve; of `high`
    Solution good;                          ///< the last that was good, of this item or one before
    Motion failed_motion;                   ///< at `high`
    Solution failed;
  };
  static constexpr int kNone = -2;  ///< no item before

  /// Levels of all items: `motion(item, level)` is what to solve, `good(solution)` judges,
  /// `same(item)` tells an item equal to the one before, `fresh(item)` one to which that suggests
  /// nothing, `report(item, track)` takes what was
  /// found (level track.low, -1: none). No allocation.
  template <typename MotionOf, typename Good, typename Same, typename Fresh, typename Report>
  void Run(Solver* solver, std::size_t items, int levels, const MotionOf& motion, const Good& good,
           const Same& same, const Fresh& fresh, const Report& report);

 private:
  static constexpr std::size_t kTracks = 16;
  static constexpr Effort kAll{};
  static constexpr Effort kQuick{
      .warm = true, .attempts = 2, .evaluations = 12, .goal = Solution::kTolerance};
  static constexpr int kNear = 1;  // levels around the suggested one that are no surprise

  static int Stride(Track* track);
  void Begin(Track* track) const;
  bool Next(Track* track) const;
  void Follow(Track* track) const;

  int levels_ = 0;
  std::array<Track, kTracks> tracks_;
  std::array<Motion, kTracks> motions_;
  std::array<Solution, kTracks> solutions_;
  std::array<std::size_t, kTracks> owner_;
};

// The first level of an item: where those before it point to.
inline void LevelSearch::Begin(Track* t) const {
  t->low = -1;
  t->high = levels_ + 1;
  t->stride = 0;
  t->level = t->suggested < 0 ? levels_ : std::min(t->suggested, levels_);
  t->all_starts = t->suggested == kNone;
  t->sure = false;
}

// Levels to go on by: 1, 1, 2, 4, ...
inline int LevelSearch::Stride(Track* t) {
  const int stride = std::max(1, t->stride);
  t->stride += stride;
  return stride;
}

// The next level to try; false: found.
inline bool LevelSearch::Next(Track* t) const {
  t->all_starts = t->suggested == kNone;
  if (t->low == levels_) return false;
  if (t->high == t->low + 1) {
    const bool surprise = t->low < 0 ? t->suggested >= 0 : std::abs(t->low - t->suggested) > kNear;
    if (t->sure || !surprise) return false;
    t->level = t->high;
    t->all_starts = true;
    return true;
  }
  if (t->low < 0) {  // none is good yet
    t->level = t->suggested < 0 ? 0 : std::max(0, t->high - Stride(t));
    t->all_starts |= t->suggested < 0;
  } else if (t->high > levels_) {  // none has failed yet
    t->level = std::min(levels_, t->low + Stride(t));
  } else {
    t->level = (t->low + t->high) / 2;
  }
  return true;
}

// What an item suggests to the next: its level, moved on as from the one before it.
inline void LevelSearch::Follow(Track* t) const {
  const int change = t->before >= 0 && t->low >= 0 ? t->low - t->before : 0;
  t->before = t->low;
  t->suggested = t->low;
  if (t->low >= 0 && t->low < levels_ && std::abs(change) <= 16) {
    t->suggested = std::clamp(t->low + change, 0, levels_);
  }
}

template <typename MotionOf, typename Good, typename Same, typename Fresh, typename Report>
void LevelSearch::Run(Solver* solver, std::size_t items, int levels, const MotionOf& motion,
                      const Good& good, const Same& same, const Fresh& fresh,
                      const Report& report) {
  levels_ = levels;
  for (std::size_t k = 0; k < kTracks; ++k) {
    Track& t = tracks_[k];
    t.item = items * k / kTracks;
    t.end = items * (k + 1) / kTracks;
    t.suggested = t.before = kNone;
    t.good.balanced = false;
    Begin(&t);
  }
  const auto judge = [&](Track* t, std::size_t k) {
    if (good(solutions_[k])) {
      if (t->level >= t->high) {  // it was not, from one start: all of them from here on
        t->high = levels_ + 1;
        t->stride = 0;
        t->suggested = kNone;
      }
      t->low = t->level;
      t->good = solutions_[k];
    } else {
      t->high = t->level;
      t->sure = t->all_starts;
      t->failed_motion = motions_[k];
      t->failed = solutions_[k];
    }
    if (Next(t)) return;
    report(t->item, *t);
    Follow(t);
    while (++t->item < t->end && same(t->item)) report(t->item, *t);
    if (t->item < t->end && fresh(t->item)) t->suggested = t->before = kNone;
    Begin(t);
  };
  for (bool any = true; any;) {
    any = false;
    for (const bool all : {false, true}) {
      std::size_t n = 0;
      for (std::size_t k = 0; k < kTracks; ++k) {
        Track& t = tracks_[k];
        if (t.item >= t.end || t.all_starts != all) continue;
        motions_[n] = motion(t.item, t.level);
        solutions_[n] = t.good;
        owner_[n++] = k;
      }
      if (n == 0) continue;
      any = true;
      solver->Solve(std::span(motions_).first(n), std::span(solutions_).first(n),
                    all ? kAll : kQuick);
      for (std::size_t k = 0; k < n; ++k) judge(&tracks_[owner_[k]], k);
    }
  }
}

}  // namespace grouser::vehicle
