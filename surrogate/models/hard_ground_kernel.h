#pragma once

#include "surrogate/models/outputs.h"

/// What the kernels of each instruction set share (see response_kernel.h).
namespace grouser::surrogate::hard {

inline constexpr int kGroup = 8;  // states at a time

/// HardGround as the kernel reads it.
struct Law {
  double friction, stiffness;  // mu; k = C/(3 mu)
  double radius, scrub_radius, half_length;
  double resistance;                           // over load
  double friction_sd, grip_sd, resistance_sd;  // of mu; mu/C sd of C; of f
};

/// States, and where their answers go; a null pointer of `part` is not written. A load that is not
/// above 0, or a number that is not finite, gets nonsense.
struct Block {
  int count;  // a multiple of kGroup
  const double *v_x, *v_y, *rim, *load;
  const double* yaw;  // null: 0
  double* part[kOutputs][kParts];
};

/// Every set gives the same bits.
using BlockFn = void (*)(const Law&, const Block&) noexcept;

}  // namespace grouser::surrogate::hard
