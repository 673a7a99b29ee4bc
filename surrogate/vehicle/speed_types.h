#pragma once

#include <cstddef>
#include <cstdint>

#include "surrogate/vehicle/solver.h"
#include "surrogate/vehicle/stop.h"

namespace grouser::vehicle {

/// A point of a path.
struct PathPoint {
  double s_m = 0;  ///< way along the path, ascending
  double curvature_per_m = 0, grade_rad = 0, bank_rad = 0;
  std::uint8_t soil = 0;  ///< index, of all wheels
};

struct SpeedOptions {
  double speed_limit_m_per_s = 0;           ///< > 0: never faster
  double worse_by_sd = 1.6448536269514722;  ///< ground that the plan must stand; see Motion
  double tip_margin = 0.1, torque_margin = 0, sinkage_margin = 0;  ///< least ones
  double acceleration_m_per_s2 = 2, braking_m_per_s2 = 2;          ///< of comfort, largest
  double start_m_per_s = 0, end_m_per_s = 0;
  bool trained_only = true;  ///< no faster than what the models' runs cover
  /// Asked for every solution that is judged; set: what is under way throws Stopped or OutOfTime,
  /// at most SpeedPlanner::kMostSolvesToStop solves later. It changes no result.
  StopWhen stop = {};
};

/// Throws std::invalid_argument "FIELD: expected X" unless `good`.
void Need(bool good, const char* field, const char* expected);
/// The same for a risk or margins that make no sense.
void CheckMargins(const SpeedOptions& options);

/// What keeps a point from being driven faster.
enum class Binding : std::uint8_t {
  kSpeedLimit,
  kTraction,
  kLateralGrip,
  kTorque,
  kRollover,
  kSinkage,
  kUntrainedSpeed,
  kModelDomain,
  kAcceleration,
  kBraking,
  kInput
};
const char* NameOf(Binding binding);
/// Of a motion whose solution is not within the limits; `gravity` [m/s^2].
Binding BindingOf(const Motion& motion, const Solution& solution, const SpeedOptions& options,
                  double gravity);

struct SpeedPoint {
  double safe_m_per_s = 0;  ///< highest at constant speed; 0: cannot be driven (see binding)
  Binding safe_binding = Binding::kSpeedLimit;
  double speed_m_per_s = 0;  ///< of the plan
  double acceleration_m_per_s2 = 0;
  Binding binding = Binding::kSpeedLimit;  ///< of the plan
  /// By how much the binding one is exceeded one level of the search (1/256 of the speed limit)
  /// above the safe speed: residual over weight, or the margin that is missing; by the secant of
  /// the margin from the points before where that level was not solved. 0 for kSpeedLimit.
  double shortfall = 0;
  /// The plan can be driven here: solved with its speed and acceleration, every margin left, and
  /// not at rest up to the next point; at the first point also no slower than the start asks.
  bool holds = false;
};

}  // namespace grouser::vehicle
