#pragma once

#include "surrogate/models/outputs.h"

/// What the kernels of each instruction set share (see response_kernel.h).
namespace grouser::surrogate::draws {

inline constexpr int kFeatures = 32;  // a multiple of 8

/// Frequencies of the features in turns, w/(2 pi).
struct Frequencies {
  alignas(64) double v_x[kFeatures], v_y[kFeatures], rim[kFeatures], load[kFeatures];
};

/// Of one output: a and b of draw_field.h.
struct Coefficients {
  alignas(64) double a[kFeatures], b[kFeatures];
};

/// One draw: standard normal numbers.
struct Member {
  Coefficients own[kOutputs];       ///< of the features with the output's parity
  Coefficients breaking[kOutputs];  ///< of those that break it; outputs even in both have none
  double friction, rolling;         ///< of hard ground
  double which;                     ///< uniform in (0, 1): which soil a mixture is
};

inline constexpr double kBreaking = 0.1;  // epsilon of draw_field.h

/// States, and where their unit errors go; a null pointer of `error` is not written.
struct Block {
  int count;
  const double *v_x, *v_y, *rim, *load;
  const Member* const* member;  ///< by state; null: error 0
  double* error[kOutputs];
  /// Their derivatives by v_x, v_y, rim speed and load; written for outputs whose first is not
  /// null.
  double* slope[kOutputs][4];
};

/// Every set gives the same bits.
using BlockFn = void (*)(const Frequencies&, const Block&) noexcept;

}  // namespace grouser::surrogate::draws
