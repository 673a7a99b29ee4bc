#pragma once

#include <string>
#include <vector>

#include "surrogate/vehicle/speed_plan.h"
#include "surrogate/vehicle/vehicle_file.h"

namespace grouser::vehicle {

/// A path as CSV with a header of s_m, curvature_per_m, grade_deg, bank_deg, soil in any order; all
/// but s_m and curvature_per_m may be missing (0, the first soil). Lines from '#' on are comments.
/// Throws InputError "FILE:LINE: COLUMN: got X, expected Y".
std::vector<PathPoint> ReadPath(const std::string& file, const Grounds& grounds);

}  // namespace grouser::vehicle
