#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "surrogate/terrain_map/slope_table.h"
#include "surrogate/vehicle/solver.h"

namespace grouser::terrain_map {

/// Called now and then with what share of the work is done; may throw to end it.
using Progress = std::function<void(double)>;

/// A straight motion at a heading from the way up a slope; speed 0: the limit of creeping.
vehicle::Motion MotionOn(double slope_rad, double heading_rad, double speed_m_per_s,
                         double worse_by_sd, std::uint8_t soil);

/// Whether a solution is within every limit and margin; `unknown`: what the models' runs do not
/// cover goes. The same judgement as of SpeedPlanner::ProbabilityToGo (a test compares them).
bool Goes(const vehicle::Solution& solution, const vehicle::SpeedOptions& limits, bool unknown);

/// Slopes that are driven creeping, by level and heading.
struct DrivenSlopes {
  std::vector<Interval> intervals;  ///< at level * headings + heading
  double level_sd = 0;              ///< best level of the ground on which the level is driven
  bool unknown_decides = false;     ///< somewhere what the runs do not cover decided
};

/// Searches them, all headings side by side: on mean ground in steps of 2.5 degrees up to 70; on
/// worse ground inside of the level before, on better ground out from it, as worse ground is taken
/// to carry no more (better ground may be outside of what the models' runs cover, and is not asked
/// where worse is driven); edges to 2e-4 rad. Of several intervals at one heading the one at the
/// least slope counts. Precondition: `levels` ascend around 0, which is one of them.
DrivenSlopes FindDrivenSlopes(vehicle::Solver* solver, std::uint8_t soil,
                              const vehicle::SpeedOptions& limits,
                              const std::vector<double>& levels, std::size_t headings, bool unknown,
                              const Progress& progress);

}  // namespace grouser::terrain_map
