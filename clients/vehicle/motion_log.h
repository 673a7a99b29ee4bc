#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "surrogate/vehicle/energy.h"

namespace grouser::cli {

/// A drive as it was logged or planned, row by row.
struct MotionLog {
  std::vector<vehicle::Motion> motions;
  std::vector<double> time_s;  ///< growing; empty: the file has no times
};

/// CSV with a header of speed_m_per_s and, if wanted, time_s, yaw_rate_rad_per_s,
/// acceleration_m_per_s2, grade_deg, bank_deg (0 where not given), soil (`soil`), in any order.
/// Lines from '#' on are comments. At most 200,000 rows. Throws InputError "FILE:LINE: COLUMN: got
/// X, expected Y", also where time does not grow.
MotionLog ReadMotionLog(const std::string& file, const std::vector<std::string>& soils,
                        std::uint8_t soil = 0);

/// Electric energy of a drive with times: each row's power until the next row [J]. Ends: of a
/// ground that errs alike all along, in the same direction as in each row's interval.
struct LogEnergy {
  double joules = 0, low = 0, high = 0, seconds = 0, metres = 0;
  /// Rows, and the time of them, that are not in the sums, as the ground gives no balance at the
  /// mean or at an end.
  std::size_t left_out = 0;
  double left_out_s = 0;
};
LogEnergy EnergyOf(const MotionLog& log, std::span<const vehicle::PowerInterval> powers);

}  // namespace grouser::cli
