#pragma once

#include <array>
#include <vector>

#include "surrogate/fit/training_set.h"
#include "surrogate/models/bekker.h"

namespace grouser::surrogate {

/// The weight w of stress profiles in the bekker kind: docs/stress-profiles.md.
inline constexpr double kProfileWeight = 0.3;

/// Least squares of the Bekker/Wong-style model against run means and, of runs
/// that have one, against the recorded stress profile:
///
///   sum_rows [rho(sum_outputs ((model - mean)/sigma)^2)
///             + rho(w 5/N sum_bins ((model - measured)/sigma_bin)^2)]
///   + sum_k ((x_k - x0_k)/s_k)^2,
///   sigma^2 = standard error^2 + patch^2 + (0.04 scale)^2,
///
/// over f_x, f_y, torque, m_z and sinkage; scale is OutputScale, rho Huber's
/// with corner 5. 14 parameters (k_c stays 0: one width does not tell it from
/// k_phi), bounded, each with a broad prior, so that a dozen runs determine
/// them. Ceres, exact derivatives (Dual), several starts; the best is taken.
///
/// Stresses: normal and tangential in every bin, at the sinkage where the model
/// carries the load; measured and sigma_bin as in ComparedProfile, the model's
/// bins smeared by a grain (ModelProfile). N is twice the number of bins in
/// contact: neighbours share grains, so that a profile of N bins counts as five
/// outputs do, w = 1 making it the equal of its run's totals. Totals cannot tell
/// where on the rim the stress stands (c1, c2, c3, n, K): that is what profiles
/// are for.
struct BekkerFitOptions {
  int starts = 3;  ///< 1 to 3
  int max_iterations = 60;
  double unit_weight = 13000;              ///< rho g of the bed [N/m^3]
  std::array<double, kOutputs> patch{};    ///< sd of one placement, over scale
  double profile_weight = kProfileWeight;  ///< w; 0: totals alone
  double smear_rad = 0;                    ///< a grain's diameter over the radius
};

struct BekkerFit {
  BekkerParameters parameters;
  double cost = 0;  ///< half of the sum above
};

/// Throws std::runtime_error when no start gives a usable solution, and as
/// HasProfile for a profile that is none.
/// `from`: warm start, or null.
BekkerFit FitBekker(const std::vector<Sample>& rows, const WheelGeometry& wheel,
                    const BekkerFitOptions& options, const BekkerParameters* from);

}  // namespace grouser::surrogate
