#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "surrogate/vehicle/solver.h"
#include "surrogate/vehicle/stop.h"

namespace grouser::vehicle {

/// What a differential-drive controller asks for, of one soil, speed and radius of path. With rim
/// speeds l, r of the sides and their distance b:
///   separation_multiplier = (r - l)/(b yaw rate), radius_multiplier = 2 v_x/(l + r)
/// so that v = multiplier (l + r)/2 and yaw rate = (r - l)/(multiplier b) undo the slip.
struct SkidConstants {
  std::string soil;
  double speed_m_per_s, radius_m;
  double separation_multiplier, separation_low,
      separation_high;  ///< ends: of the ground's interval
  double radius_multiplier, radius_low, radius_high;
  /// Variances of odometry with these multipliers, of the ground alone, by 1 s of driving:
  /// (m/s)^2 along, (rad/s)^2 in yaw.
  double variance_speed, variance_yaw_rate;
  /// Largest forward and lateral force over weight that balances (straight), at the mean ground
  /// and 1.645 sd worse.
  double pull_over_weight, pull_low;
  std::uint32_t reasons;
};

/// For each soil of `soils`, indices of `grounds` (none: all of it, mixtures among them), and each
/// speed and radius. Throws std::invalid_argument where the vehicle is no skid-steered one, a
/// number is not above 0, or a soil is not there; Stopped, at most one speed and radius
/// after `stop` was set.
std::vector<SkidConstants> ConstantsOf(const Vehicle& vehicle, const Grounds& grounds,
                                       std::span<const double> speeds,
                                       std::span<const double> radii, const StopWhen& stop = {},
                                       std::span<const std::uint8_t> soils = {});

/// As YAML for ros2_control's diff_drive_controller, a document a soil, speed and radius.
std::string YamlOf(const Vehicle& vehicle, std::span<const SkidConstants> constants);

}  // namespace grouser::vehicle
