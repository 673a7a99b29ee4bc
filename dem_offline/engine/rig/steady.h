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

/// The window of a wheel test that may be called steady.
struct SteadyWindow {
  std::size_t first = 0, last = 0;  ///< samples [first, last)
  bool drift_free = false;          ///< no output drifts
  bool precise = false;             ///< SE(F_x), SE(F_y) <= target * load
  std::string drifting;             ///< the output that drifts most, else empty
  double travel_m = 0;              ///< the longer of the paths of hub and rim
  double contact_length_m = 0;      ///< at the mean sinkage
  bool travelled = false;           ///< at least one contact length
  /// The stopping rule of a wheel test.
  bool Enough() const { return drift_free && precise && travelled; }
};

/// Arc of the rim in the ground, from where it enters to its lowest point [m]:
/// r acos(1 - z/r). A rolling wheel leaves its track near the bottom, so that this
/// is what it replaces under itself by rolling on. 0 without sinkage.
double ContactLength(double radius_m, double sinkage_m);

/// Tries windows that start at 25, 35, 45, 55 % of what was sampled from
/// `first` on and takes the longest without drift (else the last). An output
/// drifts when |t| > 3.7 (1 % of drift-free windows) and the drift is above 8 %
/// of the load (forces), 8 % of load * r (moments), 4 % of r (sinkage).
SteadyWindow FindSteady(const Series& series, std::size_t first, double load_n, double radius_m,
                        double target_relative_error);

}  // namespace grouser::dem
