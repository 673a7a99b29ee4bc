#pragma once

#include <array>
#include <vector>

#include "surrogate/fit/training_set.h"
#include "surrogate/models/bekker.h"

namespace grouser::surrogate {

/// Least squares of the Bekker/Wong-style model against run means:
///
///   sum_rows rho(sum_outputs ((model - mean)/sigma)^2) + sum_k ((x_k - x0_k)/s_k)^2,
///   sigma^2 = standard error^2 + patch^2 + (0.04 scale)^2,
///
/// over f_x, f_y, torque, m_z and sinkage; scale is OutputScale, rho Huber's
/// with corner 5. 14 parameters (k_c stays 0: one width does not tell it from
/// k_phi), bounded, each with a broad prior, so that a dozen runs determine
/// them. Ceres, numeric derivatives, several starts; the best is taken.
struct BekkerFitOptions {
  int starts = 3;             ///< 1 to 3
  int max_iterations = 60;
  double unit_weight = 13000; ///< rho g of the bed [N/m^3]
  std::array<double, kOutputs> patch{};  ///< sd of one placement, over scale
};

struct BekkerFit {
  BekkerParameters parameters;
  double cost = 0;  ///< half of the sum above
};

/// Throws std::runtime_error when no start gives a usable solution.
/// `from`: warm start, or null.
BekkerFit FitBekker(const std::vector<Row>& rows, const WheelGeometry& wheel,
                    const BekkerFitOptions& options, const BekkerParameters* from);

}  // namespace grouser::surrogate
