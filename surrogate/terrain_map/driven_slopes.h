#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "surrogate/terrain_map/slope_table.h"
#include "surrogate/vehicle/solver.h"

namespace grouser::terrain_map {

/// Called now and then with what share of the work is done; may throw to end it.
using Progress = std::function<void(double)>;

/// Slopes that are driven creeping, by level and heading.
struct DrivenSlopes {
  std::vector<Interval> intervals;      ///< at level * headings + heading
  std::vector<SlopeTable::Edge> edges;  ///< likewise: what binds creeping just outside of them
  double level_sd = 0;                  ///< best level of the ground on which the level is driven
  bool unknown_decides = false;         ///< somewhere what the runs do not cover decided
};

/// Searches them, all headings side by side: on mean ground in steps of 2.5 degrees up to 70; on
/// worse ground inside of the level before, on better ground out from it, as worse ground is taken
/// to carry no more (better ground may be outside of what the models' runs cover, and is not asked
/// where worse is driven); edges to 2e-4 rad. A slope that seems not to be driven next to one that
/// is is asked again from the solution there and from where its imbalance is least: a solve may
/// miss a balance. Of several intervals at one heading the one at the least slope counts.
/// Precondition: `levels` ascend around 0, which is one of them.
DrivenSlopes FindDrivenSlopes(vehicle::Solver* solver, std::uint8_t soil,
                              const vehicle::SpeedOptions& limits,
                              const std::vector<double>& levels, std::size_t headings, bool unknown,
                              const Progress& progress);

}  // namespace grouser::terrain_map
