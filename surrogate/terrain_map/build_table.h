#pragma once

#include <span>
#include <vector>

#include "surrogate/terrain_map/driven_slopes.h"
#include "surrogate/terrain_map/slope.h"
#include "surrogate/terrain_map/slope_table.h"

namespace grouser::terrain_map {

/// Safe speeds and what binds at each of the states, by SpeedPlanner (its plan between them is of
/// no account: they stand far apart on its path). Precondition: two states or more.
std::vector<vehicle::SpeedPoint> SafeSpeeds(const vehicle::Vehicle& vehicle,
                                            const vehicle::Grounds& grounds, std::uint8_t soil,
                                            vehicle::SpeedOptions limits,
                                            std::span<const SlopeHeading> states);

/// Tabulates one soil of a vehicle by its planner and solver. Throws std::invalid_argument for
/// options that make no sense (worse_by_sd outside of (-4, 4), trained_only false, fewer than
/// 4 headings or 3 slopes), and as SpeedPlanner does.
SlopeTable BuildTable(const vehicle::Vehicle& vehicle, const vehicle::Grounds& grounds,
                      std::uint8_t soil, const TableOptions& options, const Progress& progress);

}  // namespace grouser::terrain_map
