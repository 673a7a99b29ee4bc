#pragma once

#include "surrogate/models/bekker_law.h"

namespace grouser::surrogate {

/// Inputs that gradients are taken with respect to, in the order used here.
enum Input : int { kVx = 0, kVy, kRimSpeed, kLoad };
inline constexpr int kInputs = 4;

/// States that are solved together.
inline constexpr int kStateBlock = 8;

/// A block of states in and out, one to a lane. gradient[o][i] as in BekkerBatch.
struct alignas(64) StateBlock {
  double v_x[kStateBlock], v_y[kStateBlock], rim_speed[kStateBlock], load[kStateBlock];
  double value[kOutputs][kStateBlock];
  double gradient[kOutputs][kInputs][kStateBlock];
  double overload[kStateBlock];  ///< 1: no equilibrium
  double steps[kStateBlock];     ///< of the bracketed search
};

/// Solves a block; every lane holds valid input.
using BlockSolver = void (*)(const BekkerLaw<double>& law, const BekkerRules& rules, bool gradients,
                             StateBlock* block) noexcept;

}  // namespace grouser::surrogate
