#pragma once

#include "dem_offline/engine/laws/material.h"

namespace grouser::dem {

/// Hertz contact with restitution damping.
///   F_n = 4/3 E* sqrt(R*) delta^(3/2) + D sqrt(S_n m*) d(delta)/dt
///   S_n = 2 E* a,  a = sqrt(R* delta),  D = -2 sqrt(5/6) beta,
///   beta = ln e / sqrt(ln^2 e + pi^2)
/// so that the coefficient of restitution is e at every impact speed. The
/// damping force is not cut off where it makes the sum attractive, since the
/// cut-off would change e. Valid for overlap << R (state: under 0.1 R).
/// Source: Hertz 1882; Tsuji et al., Powder Technol. 71 (1992) 239; the form
/// of beta as in Antypov & Elliott, EPL 94 (2011) 50004.
/// Interaction range: overlap > 0. History words: none. Bounds for the time
/// step: 2 E* a, D sqrt(2 E* a m*). Energy: stored, normal damping.
struct HertzRestitution {
  static constexpr const char* kName = "hertz_restitution";
  static constexpr unsigned kProvides = kHertzRadius | kHertzElastic, kNeeds = 0;
  struct Settings {
    /// Share of critical damping 2 sqrt(S_n m*); negative: from the restitution.
    double critical_damping_share = -1;
  };
  template <class S, class V>
  static void Fields(S& s, V&& v) {
    v("critical_damping_share", s.critical_damping_share);
  }
  struct Params {
    float e_star;   ///< effective modulus E* [Pa]
    float damping;  ///< D sqrt(3/2) [-]: S_n is 3/2 of the secant stiffness 4/3 E* a
  };
  struct History {};

  static Params Make(const Elastic& a, const Elastic& b, const ContactProperties& f,
                     const Settings& s) {
    const double zeta = s.critical_damping_share;
    Require(zeta <= 2, "critical_damping_share", zeta, "<= 2");
    return {static_cast<float>(EffectiveModulus(a, b)),
            static_cast<float>(__builtin_sqrt(1.5) *
                               (zeta < 0 ? RestitutionDamping(f.restitution) : 2 * zeta))};
  }

  static constexpr double kSecantShare = 2.0 / 3;
  static double Stiffness(const Params& p, double overlap, double r_eff, double /*m_eff*/) {
    return 2.0 * p.e_star * __builtin_sqrt(r_eff * overlap);
  }
  static double Damping(const Params& p, double overlap, double r_eff, double m_eff) {
    return DampingOf(p.damping, kSecantShare * Stiffness(p, overlap, r_eff, m_eff), m_eff);
  }

  static GROUSER_HD NormalTerms Evaluate(const Params& p, const ContactGeometry& g,
                                         float overlap_rate, History&, float) {
    const float a = Sqrt(g.r_eff * g.overlap);
    const float stiffness = 4.0f / 3.0f * p.e_star * a;
    const float c = p.damping * Sqrt(stiffness * g.m_eff);
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
