#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "surrogate/vehicle/solver.h"

namespace grouser::vehicle {

/// Finds for each item along a path the highest of the levels 0 to `levels` at which it is good,
/// all levels below a good one taken to be good. Sixteen stretches of the path advance together.
///
/// An item begins at the level that those before it suggest, from their solutions, both moved on
/// in a straight line. Slack (what is left to the nearest limit; below 0: exceeded) is taken to be
/// linear in the level near the limit: where its slope is known from the items before, the level
/// follows by the secant, and a level above the best one that it puts clearly beyond the limit is
/// not solved. Every eighth item solves it all the same. Otherwise levels go on up or down by 1, 1,
/// 2, 4, ..., then by halves.
///
/// A level at which nothing is expected to balance, as at the item before, is asked from the point
/// where the imbalance was least there, but for every eighth item. Where the level found is far
/// from the suggested one it is asked again with all starts. Where none is good, the lowest and the
/// highest are, and then go on from where the starts ended; again at every eighth item, and before
/// that where the motion has changed by more than the least imbalance can make up for.
class LevelSearch {
 public:
  static constexpr int kNone = -2;  ///< no item before

  /// A solution that is not good, and its motion.
  struct Failure {
    Motion motion;
    Solution solution;
    double slack = 0;   ///< NaN: no matter of margins
    int level = kNone;  ///< kNone: there is none
    Motion asked;       ///< the last for which this level was asked in full, and what was left
    double least = 0;
  };
  /// One item on its way.
  struct Track {
    std::size_t item = 0, end = 0;
    int low = -1, high = 0;  ///< highest good and lowest failed level until now
    int above = 0;           ///< `high` before the last failure
    int level = 0, stride = 0, suggested = kNone;
    Motion motion;               ///< at `level`
    int low_before = kNone;      ///< of the item before the last
    double slack = 0;            ///< at `low`
    double slope = 0;            ///< of the slack by the level, at the limit; 0: unknown
    double edge_before = kNone;  ///< level without slack of the item before; kNone: unknown
    int unsolved = 0;            ///< items since `high` was asked in full
    bool all_starts = false, near_failure = false;  ///< where this solve begins
    bool sure = false;                              ///< `high` was asked with all starts
    bool goes_on = false;   ///< an end of all levels is asked again, from where the starts ended
    bool thorough = false;  ///< where much may be lost, a failure is asked as hard as level 0
    bool wide = false;      ///< `highest` was asked in full at this item
    bool doubt = false;     ///< a failure near another one is to be asked in full
    bool here = false;      ///< `good` is of this item
    bool failed_here = false;
    bool two = false;         ///< `before` holds a solution
    Solution good;            ///< the last that was good, of this item or one before
    Solution before;          ///< the last of the item before that
    Failure failed;           ///< at `high`, or of an item before where `high` was not solved
    Failure lowest, highest;  ///< at the ends of all levels, of items where none is good
    double shortfall = 0;     ///< by how much `high` fails, extrapolated where it was not solved
  };

  /// To be called by `seed` of Run: an item begins at that level from that solution, of a
  /// neighbour, and down to its own Track::low, if `seed` knows one. As long as much may be lost by
  /// a failure it is asked with all starts, and on from where these ended.
  static void BeginAt(int level, const Solution& solution, Track* t);

  /// Levels of all items, which are `parts` (1 or 2) equal lists one after the other: `motion(item,
  /// level)` is what to solve; `slack(solution)` judges: from 0 on good, NaN not good for a reason
  /// without a measure; `shortfall(solution)` says by how much one fails; `same(item)` tells an
  /// item equal to the one before, `fresh(item)` one to which that suggests nothing, `seed(item,
  /// track)` may set where an item begins, `report(item, track)` takes what was found (level
  /// track.low, -1: none). No allocation.
  template <typename MotionOf, typename Slack, typename Shortfall, typename Same, typename Fresh,
            typename Seed, typename Report>
  void Run(Solver* solver, std::size_t items, std::size_t parts, int levels, const MotionOf& motion,
           const Slack& slack, const Shortfall& shortfall, const Same& same, const Fresh& fresh,
           const Seed& seed, const Report& report);

 private:
  static constexpr std::size_t kTracks = Solver::kLanes, kMostParts = 2;

  void SetScales(const Vehicle& vehicle);
  static void Forget(Track* t);
  void Begin(Track* t) const;
  static bool Open(const Track& t);
  bool Next(Track* t) const;
  bool Up(Track* t) const;
  void Down(Track* t) const;
  void Follow(Track* t) const;
  void Settle(Track* t, double slack, const Solution& solution) const;
  void Fail(Track* t, double slack, const Solution& solution) const;
  static Effort Start(const Track& t, Solution* start);
  bool Remote(const Failure& failure, const Motion& motion) const;
  void Prepare(Track* t) const;

  int levels_ = 0;
  double length_ = 0, gravity_ = 0;  ///< of the vehicle
  std::array<Track, kMostParts * kTracks> tracks_;
  std::size_t count_ = 0;                           ///< of tracks
  std::array<Solution, Solver::kLanes> solutions_;  ///< by lane
};

template <typename MotionOf, typename Slack, typename Shortfall, typename Same, typename Fresh,
          typename Seed, typename Report>
void LevelSearch::Run(Solver* solver, std::size_t items, std::size_t parts, int levels,
                      const MotionOf& motion, const Slack& slack, const Shortfall& shortfall,
                      const Same& same, const Fresh& fresh, const Seed& seed,
                      const Report& report) {
  levels_ = levels;
  SetScales(solver->vehicle());
  count_ = parts * kTracks;
  for (std::size_t k = 0; k < count_; ++k) {
    Track& t = tracks_[k];
    const std::size_t first = items / parts * (k / kTracks), some = items / parts;
    t.item = first + some * (k % kTracks) / kTracks;
    t.end = first + some * (k % kTracks + 1) / kTracks;
    t.good.balanced = false;
    Forget(&t);
    Begin(&t);
    if (t.item < t.end) seed(t.item, &t);
  }
  const auto prepare = [&](Track* t) {
    if (t->item >= t->end) return;
    t->motion = motion(t->item, t->level);
    Prepare(t);
  };
  const auto advance = [&](Track* t, const Solution& solution) {
    Settle(t, slack(solution), solution);
    if (Next(t)) return;
    t->shortfall = t->low == levels_ ? 0
                   : t->failed_here  ? shortfall(t->failed.solution)
                                     : -(t->slack + t->slope);
    report(t->item, *t);
    Follow(t);
    while (++t->item < t->end && same(t->item)) report(t->item, *t);
    if (t->item < t->end && fresh(t->item)) Forget(t);
    Begin(t);
    if (t->item < t->end) seed(t->item, t);
  };
  // A track that is done takes the second half of what the longest one has left, if that begins at
  // an item to which those before it suggest nothing: it finds the same.
  const auto share = [&](Track* t) {
    Track* longest = &tracks_[0];
    for (Track& other : std::span(tracks_).first(count_)) {
      if (other.end > longest->end - longest->item + other.item) longest = &other;
    }
    const std::size_t left = longest->end - longest->item;
    if (left < 2 || longest->item >= longest->end) return false;
    const std::size_t middle = longest->end - left / 2;
    if (!fresh(middle)) return false;
    t->item = middle;
    t->end = longest->end;
    longest->end = middle;
    t->good.balanced = false;
    Forget(t);
    Begin(t);
    seed(t->item, t);
    return true;
  };
  // To each lane a track at a time.
  class Tracks final : public SolveSource {
   public:
    Tracks(LevelSearch* search, const decltype(prepare)& prepare, const decltype(advance)& advance,
           const decltype(share)& share)
        : search_(*search), prepare_(prepare), advance_(advance), share_(share) {
      for (Track*& t : track_) t = &search_.tracks_[next_++];
    }
    bool Next(std::size_t lane, Task* task) override {
      Track*& t = track_[lane];
      while (t->item >= t->end && next_ < search_.count_) t = &search_.tracks_[next_++];
      if (t->item >= t->end && !share_(t)) return false;
      prepare_(t);
      Solution* solution = &search_.solutions_[lane];
      *task = {&t->motion, solution, Start(*t, solution)};
      return true;
    }
    void Done(std::size_t lane) override { advance_(track_[lane], search_.solutions_[lane]); }

   private:
    LevelSearch& search_;
    const decltype(prepare)& prepare_;
    const decltype(advance)& advance_;
    const decltype(share)& share_;
    std::size_t next_ = 0;
    std::array<Track*, Solver::kLanes> track_;
  } source(this, prepare, advance, share);
  solver->Solve(&source);
}

}  // namespace grouser::vehicle
