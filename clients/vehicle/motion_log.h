#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "surrogate/vehicle/trajectory.h"

namespace grouser::cli {

/// A drive as it was logged or planned, row by row.
struct MotionLog {
  std::vector<vehicle::Motion> motions;
  std::vector<double> time_s;  ///< growing; empty: the file has no times
};

/// CSV with a header of speed_m_per_s and, if wanted, time_s, yaw_rate_rad_per_s,
/// acceleration_m_per_s2, grade_deg, bank_deg (0 where not given), soil (`soil`), in any order.
/// Lines from '#' on are comments. At most 200,000 rows. Throws InputError "FILE:LINE: COLUMN: got
/// X, expected Y", also where time does not grow, or by more than
/// kLongestStepS.
MotionLog ReadMotionLog(const std::string& file, const std::vector<std::string>& soils,
                        std::uint8_t soil = 0);

/// Of a drive with times: each row's power until the next row.
vehicle::DriveEnergy EnergyOf(const MotionLog& log, std::span<const vehicle::PowerInterval> powers);
/// A drive with times as a trajectory: each row until the next. Throws InputError "FILE: ..." for
/// one without times, or of one row.
std::vector<vehicle::TrajectoryStep> StepsOf(const std::string& file, const MotionLog& log);

}  // namespace grouser::cli
