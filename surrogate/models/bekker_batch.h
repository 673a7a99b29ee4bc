#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "surrogate/models/bekker_lanes.h"

namespace grouser::surrogate {

/// n states as structure of arrays for BekkerModel::SolveBatch; spans of
/// inputs have n entries, those of results n or none (not written). NaN or
/// infinite input or a load <= 0 gives NaN and harms no other state.
///
/// An answer does not depend on the state's place in the batch, on its
/// neighbours, on the instruction set, nor on whether gradients are asked for.
///
/// gradient[o][i]: derivative of output o with respect to input i at constant
/// other inputs, through the balance (dz = -(dF_z - dW)/(dF_z/dz)), exact for
/// the sums. Corners of the model give the value of one side: |r w| = V, r w = 0
/// and v_x = 0; v_y = 0 is smooth. At rest those by the velocities are 0. Without
/// equilibrium the sinkage is held at its limit.
struct BekkerBatch {
  std::span<const double> v_x, v_y, rim_speed, load;
  std::array<std::span<double>, kOutputs> value;
  std::array<std::array<std::span<double>, kInputs>, kOutputs> gradient;
  std::span<std::uint8_t> no_equilibrium;
};

}  // namespace grouser::surrogate
