#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "surrogate/vehicle/speed_plan.h"

namespace grouser::cli {

/// A path as CSV with a header of s_m and curvature_per_m, or of x_m and y_m, and, if wanted,
/// grade_deg, bank_deg, soil (0, 0, `soil`), in any order. Of places, s is the length of
/// the line through them and the curvature that of the circle through a point and its neighbours,
/// to the left; the ends have that of the point beside them. Lines from '#' on are comments. Throws
/// InputError "FILE:LINE: COLUMN: got X, expected Y", also for a place given twice in a row.
std::vector<vehicle::PathPoint> ReadPath(const std::string& file,
                                         const std::vector<std::string>& soils,
                                         std::uint8_t soil = 0);

}  // namespace grouser::cli
