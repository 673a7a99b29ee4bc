#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "surrogate/vehicle/level_search.h"
#include "surrogate/vehicle/speed_types.h"

namespace grouser::vehicle {

/// What is asked of every point of a path: the highest level at which it is good.
class PathQuestion {
 public:
  virtual Motion MotionAt(const PathPoint& point, int level) const = 0;
  virtual double Slack(const Solution& solution) const = 0;      ///< see LevelSearch::Items
  virtual double Shortfall(const Solution& solution) const = 0;  ///< the same
  virtual Binding BindingOf(const Motion& motion, const Solution& solution) const = 0;

 protected:
  ~PathQuestion() = default;
};

/// Finds the levels of all points of a path, coarse to fine. Points some metres apart are searched
/// from nothing (LevelSearch), then the middle m of two that are known, a and b, from what lies
/// between these. Where m is what they let expect, the points between are taken from the parabola
/// through a, m and b; else both halves are searched so, down to every point. It is, where
///   - grade, bank and curvature of all points between are those of parabolas through a, m and b,
///     to kStraight of the weight, or kStraightShare of the force that is asked for (ChangeOf),
///   - the same binds at all three, and the level without slack at m is that of the chord to
///     kBend levels; or all reach the highest level.
/// What is taken is only where a point is solved: at the highest level below the parabola, from the
/// parabola of the three solutions. If it is good that level is the answer, else it is searched.
/// Points between three at which nothing is good are solved only where the lowest or the highest
/// level asks for little more force along the ground, if more, than has balanced on that soil.
/// Equal points are solved once.
///
/// Source of the idea: adaptive sampling of a smooth function with a check at the middle, as in
/// adaptive quadrature (Gander and Gautschi, BIT 40, 2000).
class PathSearch final : private LevelSearch::Items {
 public:
  /// A point's answer.
  struct Node {
    int level = -1;     ///< highest good; -1: none
    Binding binding{};  ///< beyond it; kSpeedLimit: none, the highest level is good
    double shortfall = 0;
    // For its neighbours.
    bool known = false;
    double edge = 0;          ///< level without slack; +- half a level where there is no measure
    double slope = 0;         ///< see LevelSearch::Track
    std::size_t failure = 0;  ///< the point whose failure counts as this one's
    int failed_level = LevelSearch::kNone;
    double failed_slack = 0;
    // See LevelSearch::Failure: of the failure, and of the highest level where none is good (least
    // below 0: that was not asked).
    double least[2] = {-1, -1};
    std::size_t asked[2] = {};
  };

  /// Room for so many points.
  explicit PathSearch(std::size_t most);

  /// All points, in the order driven; `spacing`: of those that are searched from nothing [points].
  /// `good`, of as many points: solutions at their levels, of points without one that at the
  /// highest level; `failed`: beyond them, where one was solved. No allocation. Throws what Slack
  /// throws.
  void Run(LevelSearch* search, Solver* solver, std::span<const PathPoint> path, int levels,
           std::size_t spacing, const PathQuestion& question, std::span<Solution> good,
           std::span<Solution> failed);

  std::span<const Node> nodes() const { return std::span(nodes_).first(path_.size()); }

 private:
  struct Place {
    std::size_t left = 0, middle = 0, right = 0;
    bool between = false;  ///< of `left` and `right`
    bool quick = false;    ///< on the parabola through all three
    bool alone = false;    ///< no other point rests on its answer
    bool run = false;      ///< all points up to `right` are equal to this one
  };

  bool Begin(LevelSearch::Track* t) override;
  Motion MotionAt(std::size_t i, int level) const override {
    return question_->MotionAt(path_[i], level);
  }
  double Slack(const Solution& s) const override { return question_->Slack(s); }
  double Shortfall(const Solution& s) const override { return question_->Shortfall(s); }
  void Found(const LevelSearch::Track& t) override;

  void Lay(std::size_t spacing);
  void Push(std::size_t i);
  bool Pop(std::size_t* i);
  void Split(std::size_t a, std::size_t b);
  void CheckMiddle(std::size_t m);
  void Fill(std::size_t a, std::size_t m, std::size_t b);
  void FillNone(std::size_t a, std::size_t m, std::size_t b);
  bool MayHold(std::size_t i, int level) const;
  bool Pulls(std::size_t i, int level) const;
  void Learn(const LevelSearch::Track& t);
  void Between(std::size_t a, std::size_t b, std::size_t i, LevelSearch::Track* t) const;
  void OnParabola(const Place& p, std::size_t i, LevelSearch::Track* t) const;
  void Recall(std::size_t from, LevelSearch::Track* t) const;
  void Keep(const LevelSearch::Track& t);
  int Expected(std::size_t a, std::size_t b, std::size_t i, double share) const;
  double ForceRatio(std::size_t i, int level) const;
  bool Equal(std::size_t a, std::size_t b) const;
  bool Steep(std::size_t a, std::size_t b) const;
  bool Smooth(std::size_t a, std::size_t m, std::size_t b) const;
  bool Alike(std::size_t a, std::size_t m, std::size_t b) const;
  void Copy(std::size_t from, std::size_t to);

  std::span<const PathPoint> path_;
  std::span<Solution> good_, failed_;
  const PathQuestion* question_ = nullptr;
  int levels_ = 0;
  double half_length_ = 0, gravity_ = 0;
  /// Over the weight, by soil: force along the ground at which grip ended last; the most that
  /// balanced, braking and pulling, and that would have but for the least imbalance.
  struct Held {
    double balanced = 0, missed = 0;
  };
  std::array<double, kMostSoils + 1> grip_{};
  std::array<std::array<Held, 2>, kMostSoils + 1> held_{};
  std::vector<Node> nodes_;
  std::vector<Place> places_;
  std::vector<std::size_t> full_, quick_, none_;  ///< queues of points
  std::size_t full_begin_ = 0, full_end_ = 0, quick_begin_ = 0, quick_end_ = 0;
  std::size_t none_begin_ = 0, none_end_ = 0;
};

}  // namespace grouser::vehicle
