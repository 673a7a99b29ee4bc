#pragma once

#include <string>
#include <vector>

#include "surrogate/measured_vehicles/comparison.h"

namespace grouser::measured {

/// Root mean squares over the rows of a robot that were held back.
struct TwistMiss {
  double yaw_rad_per_s = 0, speed_m_per_s = 0;
  int rows = 0, unanswered = 0;  ///< no balance found: these do not count in the means
  int covered = -1;              ///< within the answer's own 5 to 95 %; -1: it has no such
};

/// Over the rows of a terrain to which nothing was fitted; NaN: no answer.
struct PowerMiss {
  std::string terrain;
  double share = 0, watts = 0;  ///< rms of (predicted - measured)/measured, and in W
};

/// A way to answer, what an answer takes, and how far off it is. NaN: it does not answer that.
struct Way {
  std::string name;
  double motion_us =
      0;               ///< processor time of a motion from nothing, of a batch of all of the Husky
  double plan_ms = 0;  ///< of a plan of kPlanPoints, safe speeds included
  std::vector<TwistMiss> robots;  ///< in the order of Comparison::robots
  std::vector<PowerMiss> power;   ///< in the order of PowerComparison::terrains
  double current_share = 0;       ///< straight current, loam over asphalt: |predicted/measured - 1|
};

inline constexpr std::size_t kPlanPoints = 1000;
inline constexpr std::size_t kWayDraws = 100;

/// From the cheapest to the dearest: one factor on what the rims say (yaw rate, forward speed) and
/// the power a v + b w fitted to the other terrains; hard ground; a sandy loam under tyres from a
/// table, by its law, and under rigid wheels; hard ground by draws; the median of all sandy loams.
/// Friction of hard ground and loam is what Compare fitted to the yaw rates; of all loams, and for
/// power everywhere, nothing is fitted. Times are measured in this call, one thread, the least of
/// several, or one where that takes long. Throws as Compare.
std::vector<Way> WaysOf(const Tables& tables, const Comparison& comparison);

/// `ways`: as far as asked for.
std::string JsonOf(const Comparison& comparison, const std::vector<Way>& ways);

/// As the table of docs/measured-vehicles.md.
std::string TableOf(const Comparison& comparison, const std::vector<Way>& ways);

}  // namespace grouser::measured
