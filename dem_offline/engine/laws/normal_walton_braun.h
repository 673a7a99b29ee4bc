#pragma once

#include "dem_offline/engine/laws/material.h"

namespace grouser::dem {

/// Latching spring: loading along k1, unloading and reloading along k2.
///   F = max(0, min(k1 delta, k2 (delta - delta_0))),  delta_0 = delta_max (1 - k1/k2)
/// Restitution e = sqrt(k1/k2) at every speed, without a dashpot.
/// Source: Walton & Braun, J. Rheol. 30 (1986) 949.
/// A contact that parts forgets delta_max. Interaction range: overlap > 0
/// (force only above delta_0). History words: 1. stiffness is k2, the elastic
/// one, all the time, so that tangential springs do not jump at a turn; radius
/// is sqrt(R* delta), a name only. Energy: stored F^2/(2 k2), plastic
/// k1 (1 - k1/k2) (growth of delta_max^2)/2.
struct WaltonBraun {
  static constexpr const char* kName = "walton_braun";
  static constexpr unsigned kProvides = 0, kNeeds = 0;
  struct Settings {
    double loading_stiffness_n_per_m = 1e4;  ///< k1
    double unloading_stiffness_n_per_m = 0;  ///< k2 >= k1; 0: k1/e^2 from the restitution
  };
  template <class S, class V>
  static void Fields(S& s, V&& v) {
    v("loading_stiffness_n_per_m", s.loading_stiffness_n_per_m);
    v("unloading_stiffness_n_per_m", s.unloading_stiffness_n_per_m);
  }
  struct Params {
    float k1, k2;  ///< [N/m]
  };
  struct History {
    float overlap;  ///< delta_max [m]
  };
  static constexpr unsigned kVectorWords = 0;

  static Params Make(const Elastic&, const Elastic&, const ContactProperties& f,
                     const Settings& s) {
    const double k1 = s.loading_stiffness_n_per_m;
    const double given = s.unloading_stiffness_n_per_m;
    Require(k1 > 0, "loading_stiffness_n_per_m", k1, "> 0");
    Require(given == 0 || given >= k1, "unloading_stiffness_n_per_m", given,
            "0 or >= loading_stiffness_n_per_m");
    const double k2 = given > 0 ? given : k1 / (f.restitution * f.restitution);
    return {static_cast<float>(k1), static_cast<float>(k2)};
  }

  static constexpr double kSecantShare = 1;
  static double Stiffness(const Params& p, double, double, double) { return p.k2; }
  static double Damping(const Params&, double, double, double) { return 0; }

  static GROUSER_HD NormalTerms Evaluate(const Params& p, const ContactGeometry& g, float,
                                         History& h, float) {
    const float lost = 1.0f - p.k1 / p.k2;
    const float deepest = Max(h.overlap, g.overlap);
    const float back = p.k2 * (g.overlap - deepest * lost);
    NormalTerms out;
    out.force = Max(Min(p.k1 * g.overlap, back), 0.0f);
    out.grip = out.force;
    out.stiffness = p.k2;
    out.radius = Sqrt(g.r_eff * g.overlap);
    out.damping_power = 0.0f;
    out.stored = 0.5f * out.force * out.force / p.k2;
    out.plastic = 0.5f * p.k1 * lost * (deepest - h.overlap) * (deepest + h.overlap);
    h.overlap = deepest;
    return out;
  }
};

}  // namespace grouser::dem
