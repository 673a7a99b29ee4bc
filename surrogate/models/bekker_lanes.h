#pragma once

#include "surrogate/models/bekker_law.h"

namespace grouser::surrogate {

/// Inputs that gradients are taken with respect to, in the order used here.
enum Input : int { kVx = 0, kVy, kRimSpeed, kLoad };
inline constexpr int kInputs = 4;

/// States that are solved together.
inline constexpr int kStateBlock = 64;

/// A block of states in and out, one to a lane. gradient[o][i] as in BekkerBatch.
struct alignas(64) StateBlock {
  double v_x[kStateBlock], v_y[kStateBlock], rim_speed[kStateBlock], load[kStateBlock];
  double value[kOutputs][kStateBlock];
  double gradient[kOutputs][kInputs][kStateBlock];
  double overload[kStateBlock];  ///< 1: no equilibrium
  double theta[kStateBlock];     ///< theta_f [rad], where the search ends
  double steps[kStateBlock];     ///< of the search
  double settled[kStateBlock], low[kStateBlock], high[kStateBlock];  ///< its own
  double f_low[kStateBlock], f_high[kStateBlock];
};

/// Solves the first `count` states of a block, which hold valid input.
using BlockSolver = void (*)(const BekkerLaw<double>& law, const BekkerRules& rules, bool gradients,
                             int count, StateBlock* block) noexcept;

}  // namespace grouser::surrogate
