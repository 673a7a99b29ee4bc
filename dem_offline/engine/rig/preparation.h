#pragma once

#include <cmath>

#include "dem_offline/engine/core/random.h"
#include "dem_offline/engine/rig/bed.h"
#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/packing.h"
#include "dem_offline/engine/world/world.h"

// How a bed is settled: the times and speeds of its stages, in sqrt(d/g) and
// sqrt(g d), so that a bed under another gravity is prepared in the same way.

namespace grouser::dem {

/// Time step [s] of a bed: its share of the Rayleigh time, but no more than the laws
/// bear under the bed's own weight (scaling.cc).
double BedStep(const BedSpec& bed);

/// A diameter [m] of the mixture, drawn by number.
double DrawDiameter(const std::vector<SizeBin>& sizes, Random& random);

/// Puts the grains of a world, which are at rest on its body 0, into the arrays of a tile: each
/// contact of two grains once, with the one that comes first.
void ExportGrains(World& world, Tile& tile);

/// Least and most time of a stage [s].
struct StageTimes {
  double least_s, most_s;
};
/// Viscous fall: gentle and quick.
inline double DragTime(const BedSpec& bed) { return 5.0 / 3 * GravityTime(bed.soil); }
/// Largest first velocity of a grain along an axis [m/s].
inline double FirstSpeed(const BedSpec& bed) { return 0.34 * GravitySpeed(bed.soil); }
inline StageTimes RelaxTimes(const BedSpec& bed) {
  const double time = GravityTime(bed.soil);
  return {5.0 / 3 * time, 10 * time};
}
inline StageTimes RestTimes(const BedSpec& bed) {
  const double time = GravityTime(bed.soil);
  return {10.0 / 3 * time, 50.0 / 3 * time};
}
/// Twice the free fall through the bed, and how long it takes at the final
/// speed g DragTime of the viscous one.
inline StageTimes SettleTimes(const BedSpec& bed) {
  const double g = bed.soil.gravity_m_per_s2;
  const double fall = std::sqrt(4 * bed.depth_m / g),
               slow = 2.5 * bed.depth_m / (g * DragTime(bed));
  return {fall, 2.5 * (fall + slow)};
}
/// Whole preparations, the next aimed so much lower as the last became denser at rest.
inline constexpr int kMostRounds = 6;
/// All attempts and stages at their longest [s]: a round after the first goes on from two tries.
inline double LongestPreparation(const BedSpec& bed) {
  const double settles =
                   PackingSearch::kMostAttempts + (kMostRounds - 1) * (PackingSearch::kTries - 2),
               layers = bed.soil.top.thickness_m > 0 ? 2 : 1;
  return layers * settles * SettleTimes(bed).most_s +
         kMostRounds * (RelaxTimes(bed).most_s + RestTimes(bed).most_s);
}

}  // namespace grouser::dem
