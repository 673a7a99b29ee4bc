#pragma once

#include "dem_offline/engine/bench/bed.h"

namespace grouser::dem::bench {

/// What two codes must agree on, of the grain-grain contacts of one instant.
struct Physics {
  double mean_overlap_over_radius = 0;  ///< over the smaller radius [-]
  double coordination = 0;              ///< contacts with grains per grain [-]
  double stress_zz_pa = 0;              ///< sum of F_z l_z over contacts, over the volume;
  double stress_xz_pa = 0;              ///<   compression positive
  std::int64_t contacts = 0;
};
/// `volume_m3`: of the stress tensor. Contacts between two glued grains do not
/// count. Forces are worked out anew from positions, velocities (half a step
/// old) and the histories kept.
Physics Measure(const World& world, double volume_m3);

double StressVolume(const Bed& bed);  ///< length x width x height [m^3]

}  // namespace grouser::dem::bench
