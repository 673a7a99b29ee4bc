#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "dem_offline/engine/rig/wheel_test.h"

namespace grouser::dem {

inline constexpr int kBlocks = 8;

/// Mean of a window with its block-averaged standard error: the larger of
/// those from 4, 8 and 16 blocks (correlated blocks understate it). `drift`: slope of the 8 block
/// means times the window; `drift_t`: that slope over its standard error (6 degrees of freedom).
struct BlockMean {
  double mean = 0, standard_error = 0, drift = 0, drift_t = 0, fluctuation = 0;
};
BlockMean AverageBlocks(std::span<const double> samples);

/// Largest standard error of a steady mean: of F_x and F_y over the load, of the
/// torque over load r, of the sinkage over r, of a free speed over the rig's [-].
inline constexpr double kLargestError = 0.1;

/// What a wheel test holds, which says what a steady window has to be.
struct SteadyRule {
  double load_n = 0, radius_m = 0;
  double target_relative_error = 0;   ///< for the stop: SE(F_x), SE(F_y) over the load [-]
  RigMode mode = RigMode::kRimSpeed;  ///< which axes beside the vertical are free
  double drawbar_n = 0;               ///< kFreeSlip
  double speed_m_per_s = 0;           ///< of the rig; kTowed and kFreeSlip
};
SteadyRule RuleOf(const WheelTestSpec& spec);

/// The window of a wheel test that may be called steady.
struct SteadyWindow {
  std::size_t first = 0, last = 0;  ///< samples [first, last)
  bool drift_free = false;          ///< no output and no free speed drifts
  bool speed_drifts = false;        ///< a free speed drifts: the wheel accelerates
  bool precise = false;             ///< SE(F_x), SE(F_y) <= target * load
  std::string drifting;             ///< what drifts most, else empty
  std::string unbalanced;           ///< the force of a free axis that is out of balance, else empty
  std::string uncertain;            ///< what has too large a standard error, else empty
  double travel_m = 0;              ///< the longer of the paths of hub and rim
  double contact_length_m = 0;      ///< at the mean sinkage
  bool travelled = false;           ///< at least one contact length
  bool Steady() const { return drift_free && travelled && unbalanced.empty() && uncertain.empty(); }
  /// The stopping rule of a wheel test.
  bool Enough() const { return Steady() && precise; }
};

/// Arc of the rim in the ground, from where it enters to its lowest point [m]:
/// r acos(1 - z/r). A rolling wheel leaves its track near the bottom, so that this
/// is what it replaces under itself by rolling on. 0 without sinkage.
double ContactLength(double radius_m, double sinkage_m);

/// Tries windows that start at 25, 35, 45, 55 % of what was sampled from
/// `first` on and takes the longest without drift and in balance (else the last).
/// Drift: |t| > 3.7 (1 % of drift-free windows) and above 8 % of the load (forces),
/// 8 % of load * r (moments), 4 % of r (sinkage), 8 % of the rig's speed (speed of a
/// free axis). Balance: on each free axis (F_z against the load; towed: torque
/// against 0; free slip: F_x against the drawbar) the mean net force is at most 4 of
/// its standard errors, where that is less than 3 % of the load (moments: load r)
/// 3 %, where it is more than 20 % of it 20 %. Certainty: kLargestError, asked of a
/// window without drift, since a drift adds to block-averaged errors. Every output
/// that is judged needs a full column in `series`.
SteadyWindow FindSteady(const Series& series, std::size_t first, const SteadyRule& rule);

}  // namespace grouser::dem
