#pragma once

#include "dem_offline/engine/rig/wheel_test.h"

namespace grouser::dem {

/// Mean pressure under a wheel [Pa]: load over width times contact length
/// (ContactLength, steady.h) at this sinkage.
double MeanPressure(const WheelShape& wheel, double load_n, double sinkage_m);

/// Overlap of two touching grains over their radius [-] in a bed under the
/// pressure p [Pa]: delta/R = 2.6 (p/E*)^(2/3), E* = E/(2 (1 - nu^2)) of two equal
/// grains; Hertz, spheres of about one size, delta/R under 0.1.
double OverlapUnder(double pressure_pa, double youngs_modulus_pa, double poisson_ratio);

/// The reverse: Young's modulus [Pa] for which the 99th percentile of overlaps
/// at the largest load is this share of the radius (0.01 reference, 0.04
/// coarse, 0.07 demo). Throws std::invalid_argument unless all are > 0.
double ModulusForOverlap(const WheelShape& wheel, double load_n, double sinkage_m,
                         double poisson_ratio, double overlap_over_radius);

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
