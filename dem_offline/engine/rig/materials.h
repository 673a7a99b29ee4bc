#pragma once

#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/rig/wheel_test.h"

namespace grouser::dem {

inline HertzMindlinEpsd::Params GrainParams(const GrainSoil& s, double friction) {
  const Elastic e = {s.youngs_modulus_pa, s.poisson_ratio};
  return MakeParams(e, e, {s.restitution, friction, s.rolling_friction});
}
inline HertzMindlinEpsd::Params GrainParams(const GrainSoil& s) {
  return GrainParams(s, s.friction);
}
/// The floor is as rough as the grains and rigid.
inline HertzMindlinEpsd::Params FloorParams(const GrainSoil& s) {
  return MakeWallParams({s.youngs_modulus_pa, s.poisson_ratio},
                        {s.restitution, s.friction, s.rolling_friction});
}
/// The wheel is rigid.
inline HertzMindlinEpsd::Params WheelParams(const GrainSoil& s, const WheelShape& w) {
  return MakeWallParams({s.youngs_modulus_pa, s.poisson_ratio},
                        {w.restitution, w.friction, w.rolling_friction});
}

inline double SmallestRadius(const GrainSoil& s) {
  double r = s.sizes.front().diameter_m;
  for (const auto& b : s.sizes) r = b.diameter_m < r ? b.diameter_m : r;
  return 0.5 * r;
}
inline double LargestDiameter(const GrainSoil& s) {
  double d = 0;
  for (const auto& b : s.sizes) d = b.diameter_m > d ? b.diameter_m : d;
  return d;
}
/// Mean by number [m].
inline double MeanDiameter(const GrainSoil& s) {
  double n = 0, nd = 0;
  for (const auto& b : s.sizes) {
    const double share = b.mass_fraction / (b.diameter_m * b.diameter_m * b.diameter_m);
    n += share;
    nd += share * b.diameter_m;
  }
  return nd / n;
}

}  // namespace grouser::dem
