#pragma once

#include <cmath>

#include "dem_offline/engine/rig/bed.h"
#include "dem_offline/engine/rig/materials.h"

// How a bed is settled: the times and speeds of its stages.

namespace grouser::dem {

/// Time step [s] of a bed.
inline double BedStep(const BedSpec& bed) {
  return bed.rayleigh_fraction *
         RayleighTime(SmallestRadius(bed.soil), bed.soil.density_kg_per_m3,
                      bed.soil.youngs_modulus_pa, bed.soil.poisson_ratio);
}

inline constexpr int kMostAttempts = 6;  ///< at the target solid fraction

/// Least and most time of a stage [s].
struct StageTimes {
  double least_s, most_s;
};
inline constexpr double kDragTime = 0.05;  ///< [s] viscous fall: gentle and quick
inline constexpr StageTimes kRelaxTimes = {0.05, 0.3}, kRestTimes = {0.1, 0.5};
/// Twice the free fall through the bed, and how long it takes at the final
/// speed g kDragTime of the viscous one.
inline StageTimes SettleTimes(const BedSpec& bed) {
  const double g = bed.soil.gravity_m_per_s2;
  const double fall = std::sqrt(4 * bed.depth_m / g), slow = 2.5 * bed.depth_m / (g * kDragTime);
  return {fall, 2.5 * (fall + slow)};
}
/// All attempts and stages at their longest [s].
inline double LongestPreparation(const BedSpec& bed) {
  return kMostAttempts * SettleTimes(bed).most_s + kRelaxTimes.most_s + kRestTimes.most_s;
}

}  // namespace grouser::dem
