#pragma once

#include <memory>
#include <span>
#include <vector>

#include "surrogate/vehicle/level_search.h"
#include "surrogate/vehicle/path_search.h"
#include "surrogate/vehicle/solver.h"
#include "surrogate/vehicle/speed_types.h"

namespace grouser::vehicle {

/// The grades around the level that a vehicle drives, to 1e-4 rad, as far as 85 degrees.
struct GradeRange {
  bool any = false;                 ///< false: none is driven; binding_up says why not the level
  double down_rad = 0, up_rad = 0;  ///< lowest and highest grade; both of one sign: not the level
  Binding binding_down = Binding::kSpeedLimit, binding_up = Binding::kSpeedLimit;  ///< beyond them
};

/// Ground that the models' runs do not cover may go or not: `least` counts it as not.
struct GoProbability {
  double least = 0, most = 0;
};

/// Of entries of 0 and 1, the share of those that are 1.
double ShareOf(std::span<const std::uint8_t> draws);

/// Highest safe speed at each point and a plan that can be driven: speeds by forward and backward
/// passes over what the vehicle can accelerate and brake, every point solved once more with speed
/// and acceleration, and slowed down, at last to rest, where that does not hold.
class SpeedPlanner {
 public:
  static constexpr std::size_t kMostSolvesToStop = 64;

  /// Room for paths of so many points. Throws as Solver does.
  SpeedPlanner(const Vehicle& vehicle, const Grounds& grounds, std::size_t most_points);

  /// Throws std::invalid_argument naming the point for fewer than two points, more than there is
  /// room for, numbers that are not finite, ways that do not ascend, unknown soils, options that
  /// make no sense; Stopped, after which the planner is as good as new. Then no allocation. Returns
  /// at how many points the plan does not hold.
  std::size_t Plan(std::span<const PathPoint> path, const SpeedOptions& options,
                   std::span<SpeedPoint> out);

  /// Grades that are driven straight at `speed`; 0 is the limit of creeping. Throws
  /// std::invalid_argument for speed, soil or margins that make no sense; Stopped.
  GradeRange Grades(double speed, std::uint8_t soil, const SpeedOptions& options);
  /// Probability that a motion is within every limit: by the largest worse_by_sd that is, from
  /// -4 to 4, one deviation for all wheels. Throws Stopped.
  GoProbability ProbabilityToGo(const Motion& motion, const SpeedOptions& options);

  /// Draws for what follows, as of Solver::UseDraws. Allocates, but not for none; what throws
  /// leaves the draws before.
  void UseDraws(std::shared_ptr<const GroundDraws> draws);
  /// Probability that a motion is within every limit: the share of the draws on which it is, all
  /// wheels of a soil on the same draw; standard error sqrt(p (1 - p)/draws). Its worse_by_sd and
  /// draw do not count. Throws std::invalid_argument where there are no draws; Stopped.
  GoProbability ProbabilityByDraws(const Motion& motion, const SpeedOptions& options);
  /// The draws on which several motions all are within every limit: takes those out on which this
  /// one is not (entries of 1 become 0), which are not solved again. `least` and `most`: what the
  /// models' runs do not cover counts as not going, as going; an entry a draw, `most` 1 wherever
  /// `least` is. Throws as ProbabilityByDraws.
  void KeepGoing(const Motion& motion, const SpeedOptions& options, std::span<std::uint8_t> least,
                 std::span<std::uint8_t> most);
  /// The same of motions one after the other, up to the first after which no draw is left.
  void KeepGoing(std::span<const Motion> motions, const SpeedOptions& options,
                 std::span<std::uint8_t> least, std::span<std::uint8_t> most);
  /// Share of the draws on which a plan holds at all points with every margin left, all points of
  /// a soil on the same draw; `by_point`: at each (as many as points, or none). The plan is that of
  /// Plan, for the same path and options; a point that does not hold by its speeds alone (a start
  /// that is too fast, rest up to the next point, no safe speed) holds on no draw. worse_by_sd of
  /// the options does not count. Throws as Plan and ProbabilityByDraws.
  double PlanByDraws(std::span<const PathPoint> path, const SpeedOptions& options,
                     std::span<const SpeedPoint> plan, std::span<double> by_point);

 private:
  void KeepGoingFrom(const Motion& motion, const Solution& mean, const SpeedOptions& options,
                     std::span<std::uint8_t> least, std::span<std::uint8_t> most);
  static Motion MotionAt(const PathPoint& p, const SpeedOptions& options, double speed,
                         double acceleration);
  /// What is left to the nearest margin; below 0: exceeded, NaN: not good for another reason.
  /// Every solution is judged by it: throws Stopped where the options ask for that.
  double Slack(const Solution& s, const SpeedOptions& options) const;
  bool Good(const Solution& s, const SpeedOptions& options) const { return Slack(s, options) >= 0; }
  /// Within every limit; what the runs do not cover goes if it is `unknown` that decides.
  bool Goes(const Solution& s, const SpeedOptions& options, bool unknown) const;
  void CheckPath(std::span<const PathPoint> path, const SpeedOptions& options,
                 std::size_t answers) const;
  Binding BindingOf(const Motion& m, const Solution& s, const SpeedOptions& options) const {
    return vehicle::BindingOf(m, s, options, vehicle_.gravity_m_per_s2);
  }
  double ShortfallOf(const Solution& s, const SpeedOptions& options) const;
  class Question;
  class Raising;
  class Tries;
  class Reaching;
  void Safe(std::span<const PathPoint> path, const SpeedOptions& options,
            std::span<SpeedPoint> out);
  void Raise(std::span<const PathPoint> path, const SpeedOptions& options,
             std::span<SpeedPoint> out);
  std::size_t Low(std::span<const PathPoint> path, std::span<const SpeedPoint> out);
  std::size_t Knots(std::span<const PathPoint> path, std::span<const SpeedPoint> out);
  void Reach(std::span<const PathPoint> path, const SpeedOptions& options,
             std::span<const SpeedPoint> out);
  void Spread(std::size_t knots, std::size_t points, std::vector<double>* numbers) const;
  void Passes(std::span<const PathPoint> path, const SpeedOptions& options,
              std::span<SpeedPoint> out);
  bool Verify(std::span<const PathPoint> path, const SpeedOptions& options,
              std::span<SpeedPoint> out);
  void Slow(std::span<const PathPoint> path, std::size_t i, std::span<const SpeedPoint> out);
  /// Not at rest from point i to the next.
  static bool Moves(std::span<const SpeedPoint> plan, std::size_t i);
  /// Whether point i of a plan holds wherever its solution is good, by its speeds alone.
  static bool MayHold(const SpeedOptions& options, std::span<const SpeedPoint> plan, std::size_t i);
  static std::size_t NotHeld(const SpeedOptions& options, std::span<SpeedPoint> out);

  Vehicle vehicle_;
  std::size_t soils_;
  Solver solver_;
  std::vector<Motion> motions_;
  std::vector<Solution> solutions_;  // the last good one of each point
  std::vector<Solution> tried_;
  LevelSearch search_;
  PathSearch path_search_;
  std::vector<int> reached_;        // by Reach: levels, -1: not asked
  std::vector<std::size_t> open_;   // points that are verified
  std::vector<std::size_t> knots_;  // points whose reach is searched; before: see Low
  std::vector<std::size_t> higher_;
  std::vector<std::uint8_t> risen_;
  std::shared_ptr<const GroundDraws> draws_;
  std::vector<Motion> drawn_motions_;  // of ProbabilityByDraws
  std::vector<Solution> drawn_;
  std::vector<std::uint8_t> least_, most_;
  std::vector<double> cap_;
  // Of the step from a point: most acceleration and braking that hold at rest, and the share of
  // them that is left at kSample of the safe speed.
  std::vector<double> faster_, slower_, faster_share_, slower_share_;
  std::vector<double> most_faster_;  // the same, at any speed, by what did not hold
  std::vector<double> tried_speed_, tried_acceleration_;  // as last verified
  std::vector<int> failures_;
  std::vector<Binding> slowed_by_;
};

}  // namespace grouser::vehicle
