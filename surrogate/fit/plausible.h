#pragma once

#include <span>
#include <string>
#include <vector>

#include "surrogate/fit/training_set.h"

namespace grouser::surrogate {

/// What a wheel test's means can be, whoever made them: wide enough for every
/// run that balances, narrow enough for a wrong unit (kN for N, mm for m) to show.
/// e r: radius of the outermost point, treads included.
///
///   f_z        within kLoadShare of the load
///   f_x, f_y   at most kMostForce times the load
///   torque     at most kMostFriction mu f_z e r, mu the larger of wheel and soil
///              friction and kLeastFriction: normal forces sum to more than f_z, and
///              sides rub too (largest of the shipped campaigns: 1.24 mu f_z r)
///   m_z        at most kMostForce load e r
///   sinkage    from -kLeastSinkage r less the treads' height to kMostSinkage r
namespace plausible {
inline constexpr double kLoadShare = 0.25, kMostForce = 10;
inline constexpr double kMostFriction = 2, kLeastFriction = 0.75;
inline constexpr double kLeastSinkage = 0.1, kMostSinkage = 2;
/// Of the load: the largest of |f_x|, |f_y| and |torque|/r of a single run, and its
/// median over all runs (a wheel that rolls freely has little of each, not all do).
inline constexpr double kLeastForce = 1e-4, kLeastMedianForce = 5e-3;
}  // namespace plausible

/// What bounds the outputs of one wheel.
struct WheelLimits {
  double radius_m = 0;
  double friction = plausible::kLeastFriction;  ///< mu above
  double tread_height_m = 0;                    ///< of the tallest
};
WheelLimits LimitsOf(const v1alpha1::Scene& scene);
WheelLimits LimitsOf(const v1alpha1::Model& model);

/// Why an output at a load cannot be, as "VALUE UNIT, expected ..."; empty if it can.
std::string ImpossibleOutput(int output, double value, double load_n, const WheelLimits& limits);

/// Refuses sets with runs that cannot be (only steady and drifting runs are looked
/// at: others train nothing). Throws std::invalid_argument "run ID (FILE): OUTPUT:
/// VALUE, expected ...".
void CheckRuns(const TrainingSet& set);

}  // namespace grouser::surrogate
