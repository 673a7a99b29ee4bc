#pragma once

#include <vector>

#include "dem_offline/engine/experiment/ground.h"

namespace grouser::dem::experiment {

/// Mean of a ring of an annulus over time and over the grains (clumps: their centres) in it.
struct RingMean {
  double grains = 0;                                  ///< mean number N
  double areal_fraction = 0;                          ///< N pi <d^2>/4 over the area of the ring
  double tangential_m_per_s = 0, radial_m_per_s = 0;  ///< means; right-handed about the axis
  /// <(v_t - <v_t>)^2 + (v_r - <v_r>)^2>/3 (McCarthy et al., Powder Technol. 203 (2010) 70)
  double temperature_m2_per_s2 = 0;
};

/// Collects the rings of a probe: equal widths between the inner and the outer radius of its
/// region, about the middle of it along AxisOf the box.
class RingSums {
 public:
  RingSums(const Probe& probe, const BoxSpec& box);
  void Add(const Ground& ground);
  double samples() const { return samples_; }  ///< since the last Take
  /// Means since the last Take; one sample at least was added.
  std::vector<RingMean> Take();
  double Low(std::size_t ring) const;  ///< radius [m]; of ring + 1: the outer one

 private:
  struct Sum {
    double n = 0, d2 = 0, t = 0, r = 0, tt = 0, rr = 0;
  };
  void AddOne(const Vec3d& x, const Vec3d& v, double diameter);

  Vec3d middle_;
  double inner_, width_;
  int axis_;
  std::vector<Sum> sums_;
  double samples_ = 0;
};

}  // namespace grouser::dem::experiment
