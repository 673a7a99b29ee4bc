#pragma once

#include "dem_offline/engine/laws/material.h"

namespace grouser::dem {

/// The JKR pull added to the Hertz force, as printed by Shin et al. 2020.
///   F_a = -2 sqrt(2 pi gamma E* a^3),
///   a^3 = 3 R*/(4 E*) (F + C + sqrt(2 C F + C^2)),  C = 3 pi gamma R*
/// which is F_a = -(C + sqrt(C^2 + 2 C F)), F [N] the Hertz elastic force,
/// gamma [J/m^2] the work of adhesion. At zero overlap -6 pi gamma R*, four times
/// the JKR pull-off: use it to reproduce that paper alone, `jkr` otherwise.
/// Grip stays the compression of the Hertz contact (the paper's mu |F_n|).
/// Source: J. Mech. Sci. Technol. 34 (2020) 4537, reference 1.
/// Interaction range: overlap > 0. History words: none. Energy: stored, the
/// integral of F_a by Gauss' rule with 4 points (0.1 % up to F = 100 C); it
/// vanishes at zero overlap, so nothing is lost on making or breaking.
struct JkrAdded {
  static constexpr const char* kName = "jkr_added";
  static constexpr unsigned kNeeds = kHertzElastic;
  static constexpr bool kHasRange = false;
  struct Settings {};
  template <class S, class V>
  static void Fields(S&, V&&) {}
  struct Params {
    float pull;  ///< C/R* = 3 pi gamma [N/m]
  };
  struct History {};

  static Params Make(const Elastic&, const Elastic&, const ContactProperties& f, const Settings&) {
    return {static_cast<float>(3 * 3.14159265358979323846 * f.surface_energy_j_per_m2)};
  }
  static double Range(const Params&, double, double) { return 0; }
  static double Stiffness(const Params&, double, double) { return 0; }

  static GROUSER_HD CohesionTerms Evaluate(const Params& p, const ContactGeometry& g,
                                           NormalTerms& normal, History&, float) {
    const float c = p.pull * g.r_eff;
    const float hertz = normal.stiffness * g.overlap;
    // Integral of sqrt(C^2 + 2 C F) over the overlap, u = overlap t^2.
    const float at[4] = {0.0694318442f, 0.3300094782f, 0.6699905218f, 0.9305681558f};
    const float weight[4] = {0.1739274226f, 0.3260725774f, 0.3260725774f, 0.1739274226f};
    float sum = 0.0f;
    for (int i = 0; i < 4; ++i) {
      const float t = at[i];
      sum += weight[i] * 2.0f * t * Sqrt(c * (c + 2.0f * hertz * (t * t * t)));
    }
    normal.force = normal.force - (c + Sqrt(c * (c + 2.0f * hertz)));
    normal.stored = normal.stored - g.overlap * (c + sum);
    return {g.overlap > 0.0f, 0.0f};
  }
};

}  // namespace grouser::dem
