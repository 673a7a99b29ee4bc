#pragma once

#include "dem_offline/engine/rig/wheel_test.h"

namespace grouser::dem {

/// Mean pressure under a wheel [Pa]: load over width times contact length
/// (ContactLength, steady.h) at this sinkage.
double MeanPressure(const WheelShape& wheel, double load_n, double sinkage_m);

/// Largest time step [s] at which a wheel test keeps its energy: 0.75 of the least
/// PackedLimit (laws/time_step.h) over the sizes, from what the laws of the soil and
/// at the wheel state, at this overlap over the radius.
/// Measured, in Rayleigh times, where the energy residual jumps from
/// 1e-4 past 2e-2 (9 mm grains, Hertz-Mindlin with rolling friction 0.3): 0.25 at
/// restitution 0.5 and overlap 0.06, 0.15 at 0.2, about 0.29 at 0.9; 0.27 and 0.32
/// at 0.5 and overlaps of 0.026 and 0.015.
double LargestStep(const GrainSoil& soil, const WheelShape& wheel, double overlap_over_radius);

/// A share of the smallest grain's Rayleigh time, but no more than the laws bear
/// (LargestStep without its safety of 0.75).
double StepWithin(const GrainSoil& soil, const WheelShape& wheel, double rayleigh_fraction,
                  double overlap_over_radius);

/// Overlap to expect under the wheel, for LargestStep, by the
/// soil's own laws: that at the mean
/// pressure of a wheel that sinks a fifth of its radius (measured 0.068 for 0.069
/// at 24 N and 5 MPa, 0.028 for 0.027 at 20 MPa, 0.088 for 0.128 at 60 N).
double LoadedOverlap(const GrainSoil& soil, const WheelShape& wheel, double load_n);

/// Time step [s] of a wheel test: StepWithin, or where its scene says so LargestStep.
double ExperimentStep(const WheelTestSpec& spec);

}  // namespace grouser::dem
