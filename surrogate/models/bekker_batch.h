#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// Inputs that gradients are taken with respect to, in the order used here.
enum Input : int { kVx = 0, kVy, kRimSpeed, kLoad };
inline constexpr int kInputs = 4;

/// n states as structure of arrays for BekkerModel::SolveBatch; spans of
/// inputs have n entries, those of results n or none (not written).
///
/// Against BekkerModel::Solve:
/// - the quadrature is another: 6 to 16 points per branch (the shorter K over r,
///   the more), graded towards the edge of the contact. Its error over the load,
///   against Points::kFine on 40000 random states of n 0.3 to 1.4 (beside it that
///   of Solve, whose median is 5e-6):
///     K/r          median   99 of 100         worst
///     over 0.08    <= 1e-6  2e-5 (1e-4)       1e-3 (2e-4)
///     0.02 - 0.08  2e-8     8e-5 (1e-4)       6e-3 (7e-4)
///     under 0.02   2e-9     3e-4 (2e-4)       2e-2 (8e-3)
///   The worst are straight, braked wheels whose shear turns round within the
///   contact; with lateral motion no state is off by more than 1e-4;
/// - |ln(F_z/load)| <= 1e-4 is met by iteration, the rest by one linear step of
///   every output along the sinkage: balanced to 1e-7 of the load;
/// - the static wheel (all speeds 0) is an ordinary state: f_z, sinkage and
///   their derivatives with the load, the rest 0, that is the mean over all
///   directions in which it may start;
/// - NaN or infinite input or a load <= 0 gives NaN and harms no other state.
///
/// An answer does not depend on the state's place in the batch, on its
/// neighbours, on the instruction set, nor on whether gradients are asked for.
///
/// gradient[o][i]: derivative of output o with respect to input i at constant
/// other inputs, through the balance (dz = -(dF_z - dW)/(dF_z/dz)), exact for
/// the quadrature but for the 1e-4 above. Corners of the model give the value of
/// one side: |r w| = V, r w = 0 and v_x = 0; v_y = 0 is smooth. Without
/// equilibrium the sinkage is held at its limit.
struct BekkerBatch {
  std::span<const double> v_x, v_y, rim_speed, load;
  std::array<std::span<double>, kOutputs> value;
  std::array<std::array<std::span<double>, kInputs>, kOutputs> gradient;
  std::span<std::uint8_t> no_equilibrium;
};

}  // namespace grouser::surrogate
