#pragma once

#include <array>

#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

class BekkerModel;

/// States that are solved together; most points of a rule.
inline constexpr int kBlock = 8, kMostPoints = 16;

/// Graded Gauss rule on [0, 1], for one branch of the contact.
struct LaneRule {
  int points;
  const double *node, *weight;
};

/// What the vector code reads of a model: constants of BekkerModel's equations.
struct LaneModel {
  LaneRule rule;                        ///< 6, 8, 12 or 16 points, see BekkerBatch
  std::array<LaneRule, 2> first_rules;  ///< of the first two Newton steps
  double radius, width, theta_max;
  double log_modulus, n, log_guess;  ///< ln k; n; ln of F_z/z^(n + 1/2) of the first guess
  double cohesion, inv_cohesion, friction;
  double inv_shear, shear_over_bulldozing, inv_bulldozing;
  double c1, c2, c3, sinkage_drive, sinkage_brake, sinkage_lateral;
  double turn_spin, inv_turn_speed;
  double side_square, side_linear, front_square, front_linear;  ///< R(h) = square h^2 + linear h
  double traction;                                              ///< e, shearing radius over r
};
LaneModel MakeLaneModel(const BekkerModel& model) noexcept;

/// A block of states in and out, one to a lane. gradient[o][i] as in BekkerBatch.
struct alignas(64) StateBlock {
  double v_x[kBlock], v_y[kBlock], rim_speed[kBlock], load[kBlock];
  double value[kOutputs][kBlock];
  double gradient[kOutputs][4][kBlock];
  double overload[kBlock];    ///< 1: no equilibrium
  double iterations[kBlock];  ///< of the bracketed search
};

/// Solves a block; every lane holds valid input.
using BlockSolver = void (*)(const LaneModel& model, bool gradients, StateBlock* block) noexcept;

/// "avx512", "avx2", "baseline", or null: the best of this machine. Null where
/// this machine lacks the set. All sets give the same bits.
BlockSolver BlockSolverFor(const char* instruction_set) noexcept;

}  // namespace grouser::surrogate
