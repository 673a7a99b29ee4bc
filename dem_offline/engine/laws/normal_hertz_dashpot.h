#pragma once

#include "dem_offline/engine/laws/material.h"

namespace grouser::dem {

/// Hertz spring with a constant dashpot.
///   F_n = 4/3 E* sqrt(R*) delta^(3/2) + c d(delta)/dt,   c constant
/// c [N s/m] is given, or as a share zeta of critical damping at a reference
/// overlap delta_0 = s R*:
///   c = 2 zeta sqrt(k_0 m*),   k_0 = dF/d(delta)(delta_0) = 2 E* R* sqrt(s).
/// The force jumps to c v at touch; restitution rises with the impact speed
/// and the restitution of the ContactProperties is not used.
/// Source: damped Hertz spring of Shin et al. 2020 (reference 1, nu_n); the share
/// at a reference overlap is ours.
/// Interaction range: overlap > 0. History words: none. Bounds for the time
/// step: 2 E* a, c. Energy: stored, normal damping.
struct HertzDashpot {
  static constexpr const char* kName = "hertz_dashpot";
  static constexpr unsigned kProvides = kHertzRadius | kHertzElastic, kNeeds = 0;
  struct Settings {
    double damping_n_s_per_m = 0;           ///< c; 0: from the share below
    double critical_damping_share = 0.1;    ///< zeta at the reference overlap
    double reference_overlap_share = 0.01;  ///< s = delta_0/R*
  };
  template <class S, class V>
  static void Fields(S& s, V&& v) {
    v("damping_n_s_per_m", s.damping_n_s_per_m);
    v("critical_damping_share", s.critical_damping_share);
    v("reference_overlap_share", s.reference_overlap_share);
  }
  /// c = fixed + share sqrt(R* m*).
  struct Params {
    float e_star;  ///< E* [Pa]
    float fixed;   ///< [N s/m]
    float share;   ///< 2 zeta sqrt(2 E* sqrt(s)) [sqrt(Pa)]
  };
  struct History {};

  static Params Make(const Elastic& a, const Elastic& b, const ContactProperties&,
                     const Settings& s) {
    Require(s.damping_n_s_per_m >= 0, "damping_n_s_per_m", s.damping_n_s_per_m, ">= 0");
    Require(s.critical_damping_share >= 0 && s.critical_damping_share <= 2,
            "critical_damping_share", s.critical_damping_share, "in [0, 2]");
    Require(s.reference_overlap_share > 0, "reference_overlap_share", s.reference_overlap_share,
            "> 0");
    const double e_star = EffectiveModulus(a, b);
    const double k_per_radius = 2 * e_star * __builtin_sqrt(s.reference_overlap_share);
    const bool given = s.damping_n_s_per_m > 0;
    return {static_cast<float>(e_star), static_cast<float>(s.damping_n_s_per_m),
            given
                ? 0.0f
                : static_cast<float>(2 * s.critical_damping_share * __builtin_sqrt(k_per_radius))};
  }

  static constexpr double kSecantShare = 2.0 / 3;
  static double Stiffness(const Params& p, double overlap, double r_eff, double /*m_eff*/) {
    return 2.0 * p.e_star * __builtin_sqrt(r_eff * overlap);
  }
  static double Damping(const Params& p, double /*overlap*/, double r_eff, double m_eff) {
    return p.fixed + p.share * __builtin_sqrt(r_eff * m_eff);
  }

  static GROUSER_HD NormalTerms Evaluate(const Params& p, const ContactGeometry& g,
                                         float overlap_rate, History&, float) {
    const float a = Sqrt(g.r_eff * g.overlap);
    const float stiffness = 4.0f / 3.0f * p.e_star * a;
    const float c = p.fixed + p.share * Sqrt(g.r_eff * g.m_eff);
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
