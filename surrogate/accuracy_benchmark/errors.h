#pragma once

#include <array>
#include <string>
#include <vector>

#include "surrogate/models/wheel_model.h"

// How good answers are: one table for every kind of model.

namespace grouser::surrogate {

/// An answer beside the truth, at one wheel state. Half width 0: no interval.
struct Compared {
  double slip, attack_angle_rad, load_n;
  std::array<double, kOutputs> truth, value, half_width;
};

struct BenchmarkRow {
  std::string pair, kind, reference;  ///< reference: dem, or measured
  double ns_per_answer = 0;           ///< one core; NaN: does not apply
  std::string output, region;
  int n = 0;
  double rmse = 0;           ///< [N, N m, m]
  double p95_over_load = 0;  ///< 95th percentile of |error| over load, load r or r
  double r2 = 0;  ///< 1 - sum of squared errors over that about the mean; NaN: under 3 states
  double noise_ratio = 0;  ///< rmse over the patch noise (rms over the states); NaN: unknown
  double coverage90 = 0;   ///< share inside the nominal 90 % interval; NaN: no interval
  bool covered = false;    ///< that share lies in the exact 95 % binomial band
  double width_sd = 0;     ///< mean interval width over the sd of the errors
};

/// Rows by region and output (f_z, which is the load, left out). Regions: all,
/// braking, towed, driving, lateral (error_table.h) and core (slip 0.1 to 0.9, up
/// to 30 degrees); against a measurement (head.reference) all and those of form_error.h; those
/// without a state are left out. noise: sd of one random placement over OutputScale, 0 where
/// unknown. Outputs whose truth is NaN somewhere are compared where it is not.
std::vector<BenchmarkRow> MeasureErrors(const BenchmarkRow& head,
                                        const std::vector<Compared>& answers,
                                        const std::array<double, kOutputs>& noise, double radius_m);

}  // namespace grouser::surrogate
