#pragma once

#include <span>
#include <vector>

#include "surrogate/terrain_map/slope_table.h"

namespace grouser::terrain_map {

/// What one cell of a map answers for one heading.
struct CellAnswer {
  float speed_m_per_s = 0;     ///< made good: over the map; 0: not driven at the risk asked for
  float joules_per_metre = 0;  ///< of the map, on mean ground at that speed; NaN: not driven
  float go_least = 0, go_most = 0;
  vehicle::Binding binding{};
};

/// Cell of soils with probabilities p_s (of sum 1), one a table. With V what is left when the least
/// probable soils are left out as long as their probabilities sum to less than `negligible` (equal
/// ones together; never the most probable one):
///   P(GO) = sum p_s P_s over all soils,  v = min of the safe speeds of V (what binds is its),
///   speed made good = v cos(grade),
///   energy per metre = sum_V p_s power_s(v)/(v cos(grade)) / sum_V p_s.
/// v is a speed at which every soil that is not negligible is driven at the risk of the table: one
/// who does not know the soil can drive no faster.
CellAnswer AnswerOf(std::span<const SlopeTable> tables, std::span<const float> probabilities,
                    double negligible, double slope_rad, double heading_rad) noexcept;

}  // namespace grouser::terrain_map
