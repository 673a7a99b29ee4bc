#pragma once

#include <cstdint>
#include <vector>

#include "surrogate/vehicle/solver.h"
#include "surrogate/vehicle/speed_plan.h"

namespace grouser::terrain_map {

/// A straight motion at a heading from the way up a slope; speed 0: the limit of creeping.
vehicle::Motion MotionOn(double slope_rad, double heading_rad, double speed_m_per_s,
                         double worse_by_sd, std::uint8_t soil);

/// Whether a solution is within every limit and margin; `unknown`: what the models' runs do not
/// cover goes. The same judgement as of SpeedPlanner::ProbabilityToGo (a test compares them).
bool Goes(const vehicle::Solution& solution, const vehicle::SpeedOptions& limits, bool unknown);

/// Solves one motion from `near`, if that is balanced, then from all starts, then from where the
/// imbalance of these was least.
vehicle::Solution SolveNear(vehicle::Solver* solver, const vehicle::Motion& motion,
                            const vehicle::Solution& near);

/// Whether slopes are driven creeping, many at a time.
class CreepingBatch {
 public:
  /// `headings`: how many, evenly around the way up. `limits` must outlive it.
  CreepingBatch(vehicle::Solver* solver, std::uint8_t soil, const vehicle::SpeedOptions& limits,
                std::size_t headings, bool unknown)
      : solver_(solver), soil_(soil), limits_(limits), headings_(headings), unknown_(unknown) {}

  /// Puts a question; those of the answer before are gone. `near`: where its search begins, if
  /// that is balanced; it then goes on with all starts.
  void Ask(std::size_t heading, double slope, double sd, const vehicle::Solution* near);
  /// Solves what was asked, in rows of so many neighbours (1: each next to one that goes). What
  /// does not go next to what does is asked again, once from each such neighbour and once from
  /// where its own imbalance was least, as long as that changes an answer.
  void Answer(std::size_t row);

  bool goes(std::size_t i) const { return goes_[i] != 0; }
  const vehicle::Solution& solution(std::size_t i) const { return solutions_[i]; }
  /// What binds, of one that does not go.
  vehicle::Binding BindingAt(std::size_t i) const;
  /// What the models' runs do not cover was the reason of an answer.
  bool unknown_decides() const { return unknown_decides_; }

 private:
  bool AskAgain(std::size_t row);

  vehicle::Solver* solver_;
  std::uint8_t soil_;
  const vehicle::SpeedOptions& limits_;
  std::size_t headings_;
  bool unknown_, unknown_decides_ = false, answered_ = false;
  std::vector<vehicle::Motion> motions_, again_;
  std::vector<vehicle::Solution> solutions_, tried_;
  std::vector<std::size_t> owner_;
  std::vector<char> goes_;
  std::vector<unsigned char> asked_;  // from where again: bits of kBefore, ...
};

}  // namespace grouser::terrain_map
