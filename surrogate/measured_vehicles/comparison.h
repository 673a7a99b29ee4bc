#pragma once

#include <optional>
#include <string>
#include <vector>

#include "surrogate/measured_vehicles/power.h"
#include "surrogate/measured_vehicles/yaw.h"

namespace grouser::measured {

/// The rim speeds of husky_power are those of a wheel of 0.165 m as somebody counted them with
/// 0.13 m (the constant of the recordings' own repository): times this the commanded speeds are
/// round (0.3, 0.5, 1 m/s), and 1 m/s is the robot's limit.
inline constexpr double kRimScale = 0.1651 / 0.13;

struct RobotYaw {
  std::string robot;
  double target;
  YawComparison hard, soil;
};

/// Nobody says which loam or snow was driven on. A soil stands for a terrain: the first that
/// `grouser soil suggest --like` names for its words; beside it the median of all of that name.
struct Comparison {
  std::vector<RobotYaw> robots;
  PowerComparison power;      ///< suggested soils, tyres, rim speeds as recorded
  PowerComparison rescaled;   ///< the same, rim speeds times kRimScale
  PowerComparison rigid;      ///< as `power`, rigid wheels
  PowerComparison all_soils;  ///< as `power`, medians
  std::optional<PloughedComparison> ploughed, ploughed_rigid, ploughed_all_soils;
};

/// Where the tables are: those of this checkout, unless said otherwise.
struct Tables {
  std::string windows, power;
  std::string currents;  ///< folder of CONCRETE_*.csv and PLOUGHED_*.csv; empty: left out
};

/// Reads all and compares. Throws std::invalid_argument naming file, line and what was expected.
Comparison Compare(const Tables& tables);

/// A row of the aims: what was to be met, and what is.
struct Verdict {
  std::string row;
  double target, value;  ///< NaN: no prediction
  bool held;
  std::string note;
};
std::vector<Verdict> VerdictsOf(const Comparison& comparison);

std::string TextOf(const Comparison& comparison);

}  // namespace grouser::measured
