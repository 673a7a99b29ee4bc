#pragma once

#include <cstdint>

#include "surrogate/terrain_map/build_table.h"

namespace grouser::terrain_map {

/// Errors of a table against direct solves.
struct Errors {
  std::size_t count = 0, skipped = 0;       ///< skipped: one side has no number
  double median = 0, p95 = 0, largest = 0;  ///< of the absolute ones
};
struct TableErrors {
  std::size_t states = 0;
  Errors speed;   ///< safe speed over the limit, where both are driven [-]
  Errors energy;  ///< J/m over the median of the direct ones, where both are driven [-]
  Errors go;      ///< P(GO) `least` [-]
  /// States in which the table drives and the direct solve does not, and the other way round.
  std::size_t only_table = 0, only_direct = 0;
  /// Largest distance of such a state from the edge of what the table drives [rad of slope].
  double edge_rad = 0;
};

/// Compares at random states, even in slope from 0 to 1.2 of the highest driven one and in heading,
/// drawn from `seed`. Direct, each state for itself and from the solver's own starts: the safe
/// speed by bisection to 1/256 of the limit from creeping up, every speed below one that is driven
/// taken to be driven; SpeedPlanner's ProbabilityToGo; energy by PowerOf at that safe speed. A
/// solve may miss a balance: then it is the direct answer that is in error.
TableErrors CheckTable(const vehicle::Vehicle& vehicle, const vehicle::Grounds& grounds,
                       std::uint8_t soil, const TableOptions& options, const SlopeTable& table,
                       std::size_t states, std::uint32_t seed, const Progress& progress);

}  // namespace grouser::terrain_map
