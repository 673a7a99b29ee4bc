#pragma once

#include "dem_offline/engine/laws/material.h"

namespace grouser::dem {

/// Hertz spring with a damper proportional to overlap and velocity.
///   F_n = 4/3 E* sqrt(R*) delta^(3/2) + beta delta d(delta)/dt
/// beta [kg/(m s)] is given, or from a share zeta of critical damping at a
/// reference overlap delta_0 = s R*:
///   beta = 2 zeta sqrt(k_0 m*)/delta_0,   k_0 = dF/d(delta)(delta_0) = 2 E* R* sqrt(s)
/// The force starts from zero at touch; restitution falls with the impact speed
/// (1 - e^2 grows as v^(3/5) where it is small) and the restitution of the ContactProperties
/// is not used.
/// Source: Oden & Martins, Comput. Methods Appl. Mech. Eng. 52 (1985) 527, as in
/// McCarthy et al. 2010 (reference 3), eq. 8, version 2 "n". The share at a
/// reference overlap is ours: the card gives only a number. A dashpot that does
/// not depend on the overlap is HertzDashpot.
/// Interaction range: overlap > 0. History words: none. Bounds for the time
/// step: 2 E* a, beta delta. Energy: stored, normal damping.
struct HertzOdenMartins {
  static constexpr const char* kName = "hertz_oden_martins";
  static constexpr unsigned kProvides = kHertzRadius | kHertzElastic, kNeeds = 0;
  struct Settings {
    double damping_kg_per_m_s = 0;          ///< beta; 0: from the share below
    double critical_damping_share = 0.1;    ///< zeta at the reference overlap
    double reference_overlap_share = 0.01;  ///< s = delta_0/R*
  };
  template <class S, class V>
  static void Fields(S& s, V&& v) {
    v("damping_kg_per_m_s", s.damping_kg_per_m_s);
    v("critical_damping_share", s.critical_damping_share);
    v("reference_overlap_share", s.reference_overlap_share);
  }
  /// beta = fixed + share sqrt(m*/R*).
  struct Params {
    float e_star;  ///< E* [Pa]
    float fixed;   ///< [kg/(m s)]
    float share;   ///< 2 zeta sqrt(2 E* sqrt(s))/s [sqrt(Pa)]
  };
  struct History {};

  static Params Make(const Elastic& a, const Elastic& b, const ContactProperties&,
                     const Settings& s) {
    Require(s.damping_kg_per_m_s >= 0, "damping_kg_per_m_s", s.damping_kg_per_m_s, ">= 0");
    Require(s.critical_damping_share >= 0 && s.critical_damping_share <= 2,
            "critical_damping_share", s.critical_damping_share, "in [0, 2]");
    Require(s.reference_overlap_share > 0, "reference_overlap_share", s.reference_overlap_share,
            "> 0");
    const double e_star = EffectiveModulus(a, b), share = s.reference_overlap_share;
    const double k_per_radius = 2 * e_star * __builtin_sqrt(share);
    const bool given = s.damping_kg_per_m_s > 0;
    return {static_cast<float>(e_star), static_cast<float>(s.damping_kg_per_m_s),
            given ? 0.0f
                  : static_cast<float>(2 * s.critical_damping_share * __builtin_sqrt(k_per_radius) /
                                       share)};
  }

  static constexpr double kSecantShare = 2.0 / 3;
  static double Stiffness(const Params& p, double overlap, double r_eff, double /*m_eff*/) {
    return 2.0 * p.e_star * __builtin_sqrt(r_eff * overlap);
  }
  static double Damping(const Params& p, double overlap, double r_eff, double m_eff) {
    return (p.fixed + p.share * __builtin_sqrt(m_eff / r_eff)) * overlap;
  }

  static GROUSER_HD NormalTerms Evaluate(const Params& p, const ContactGeometry& g,
                                         float overlap_rate, History&, float) {
    const float a = Sqrt(g.r_eff * g.overlap);
    const float stiffness = 4.0f / 3.0f * p.e_star * a;
    const float c = (p.fixed + p.share * Sqrt(g.m_eff / g.r_eff)) * g.overlap;
    NormalTerms out;
    out.force = stiffness * g.overlap + c * overlap_rate;
    out.grip = Max(out.force, 0.0f);
    out.stiffness = stiffness;
    out.radius = a;
    out.damping_power = c * overlap_rate * overlap_rate;
    out.stored = 0.4f * stiffness * g.overlap * g.overlap;
    out.plastic = 0.0f;
    return out;
  }
};

}  // namespace grouser::dem
