#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "surrogate/vehicle/solver.h"

namespace grouser::vehicle {

/// Finds for each item of a list the highest of the levels 0 to `levels` at which it is good, all
/// levels below a good one taken to be good. Sixteen items advance together.
///
/// An item begins at the level, and from the solution, that its neighbours suggest. Slack (what is
/// left to the nearest limit; below 0: exceeded) is taken to be linear in the level near the limit:
/// where its slope is known from neighbours, the level follows by the secant, and a level above the
/// best one that it puts clearly beyond the limit is not solved. Otherwise levels go on up or down
/// by 1, 1, 2, 4, ..., then by halves.
///
/// A level at which nothing is expected to balance, as at a neighbour, is asked from the point
/// where the imbalance was least there. Where the level found is far from the suggested one it is
/// asked again with all starts. Where none is good, the lowest and the highest are, and then go on
/// from where the starts ended, but where the motion differs from the neighbour's by less than what
/// could make up for the least imbalance there.
class LevelSearch {
 public:
  static constexpr int kNone = -2;  ///< nothing is known

  /// A solution that is not good, and its motion.
  struct Failure {
    Motion motion;
    Solution solution;
    double slack = 0;   ///< NaN: no matter of margins
    int level = kNone;  ///< kNone: there is none
    // The last motion for which this level was asked in full, whose item that was, what was left.
    Motion asked;
    std::size_t asked_item = 0;
    double least = 0;
  };
  /// One item on its way.
  struct Track {
    std::size_t item = 0;
    int low = -1, high = 0;  ///< highest good and lowest failed level until now
    int above = 0;           ///< `high` before the last failure
    int level = 0, stride = 0;
    int suggested = kNone;  ///< by neighbours; -1: none is good there
    Motion motion;          ///< at `level`
    double slack = NAN;     ///< at `low`
    double slope = 0;       ///< of the slack by the level, at the limit; 0: unknown
    bool quick = false;     ///< the suggested level is the answer if it is good
    bool light = false;     ///< no level is asked twice
    bool wary = false;      ///< what neighbours suggest is no more than a guess
    /// The lowest and the highest level are as hopeless as at a neighbour.
    bool hopeless[2] = {};
    bool thorough = false;  ///< the first failure and that at level 0 are asked as hard as can be
    bool hard = false;      ///< ... and the first was
    bool all_starts = false, near_failure = false;  ///< where this solve begins
    bool sure = false;                              ///< `high` was asked with all starts
    bool goes_on = false;  ///< an end of all levels is asked again, from where the starts ended
    bool wide = false;     ///< `highest` was asked in full at this item
    bool doubt = false;    ///< a failure near another one is to be asked in full
    bool here = false;     ///< `good` is of this item
    bool failed_here = false;
    Solution good;            ///< the last that was good, of this item or a neighbour
    Failure failed;           ///< at `high`, or of a neighbour where `high` was not solved
    Failure lowest, highest;  ///< at the ends of all levels, of items where none is good
    double shortfall = 0;     ///< by how much `high` fails, extrapolated where it was not solved
  };

  /// The items, one by one, and what is asked of them.
  class Items {
   public:
    /// Begins an item: sets t->item and what neighbours suggest: `suggested` with `good` and, where
    /// known, `slope` and the failures; `low`, if known. All else of *t is as new, but for the
    /// numbers of solutions and motions. False: none now; asked again after each Found.
    virtual bool Begin(Track* t) = 0;
    /// What to solve for a level.
    virtual Motion MotionAt(std::size_t item, int level) const = 0;
    /// From 0 on good; NaN: not good for a reason without a measure.
    virtual double Slack(const Solution& solution) const = 0;
    /// By how much one fails that is not good.
    virtual double Shortfall(const Solution& solution) const = 0;
    /// Takes what was found: level t.low, -1: none.
    virtual void Found(const Track& t) = 0;

   protected:
    ~Items() = default;
  };

  /// To be called by Items::Begin: the search begins at that level from that solution, of a
  /// neighbour, and goes down to the item's own Track::low. As long as much may be lost by a
  /// failure it is asked with all starts, and on from where these ended.
  static void BeginAt(int level, const Solution& solution, Track* t);

  /// Finds the levels of all items. No allocation. What is found for an item does not depend on
  /// which others are searched beside it.
  void Run(Solver* solver, int levels, Items* items);

 private:
  static constexpr std::size_t kTracks = Solver::kLanes;
  class Source;

  void SetScales(const Vehicle& vehicle);
  static void Clear(Track* t);
  void Begin(Track* t) const;
  static bool Open(const Track& t);
  bool Next(Track* t) const;
  bool Up(Track* t) const;
  void Down(Track* t) const;
  void Settle(Track* t, double slack, const Solution& solution) const;
  void Fail(Track* t, double slack, const Solution& solution) const;
  static Effort Start(const Track& t, Solution* start);
  bool Remote(const Failure& failure, const Motion& motion) const;
  void Prepare(Track* t) const;

  int levels_ = 0;
  double length_ = 0, gravity_ = 0;  ///< of the vehicle
  std::array<Track, kTracks> tracks_;
  std::array<Solution, kTracks> solutions_;  ///< by lane
};

/// Half the longest distance of two wheels: the arm of a change of curvature [m].
double HalfLengthOf(const Vehicle& vehicle);
/// How much the force that two motions ask of the ground differs, over the weight, with the path
/// of the wheels (half length times change of curvature) taken for a part of it.
double ChangeOf(const Motion& a, const Motion& b, double half_length, double gravity);

}  // namespace grouser::vehicle
