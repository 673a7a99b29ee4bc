#pragma once

#include "dem_offline/engine/laws/normal_hertz_spring.h"

namespace grouser::dem {

/// Hertz contact with restitution damping.
///   F_n = 4/3 E* sqrt(R*) delta^(3/2) + D sqrt(S_n m*) d(delta)/dt
///   S_n = 2 E* a,  a = sqrt(R* delta),  D = -2 sqrt(5/6) beta,
///   beta = ln e / sqrt(ln^2 e + pi^2)
/// so that the coefficient of restitution is e at every impact speed.
/// Source: Hertz 1882; Tsuji et al., Powder Technol. 71 (1992) 239; the form
/// of beta as in Antypov & Elliott, EPL 94 (2011) 50004.
/// Damping bound: D sqrt(2 E* a m*). The rest as of HertzSpring.
struct HertzRestitution : HertzSpring<HertzRestitution> {
  static constexpr const char* kName = "hertz_restitution";
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

  static Params Make(const Elastic& a, const Elastic& b, const ContactProperties& f,
                     const Settings& s) {
    const double zeta = s.critical_damping_share;
    Require(zeta <= 2, "critical_damping_share", zeta, "<= 2");
    return {static_cast<float>(EffectiveModulus(a, b)),
            static_cast<float>(__builtin_sqrt(1.5) *
                               (zeta < 0 ? RestitutionDamping(f.restitution) : 2 * zeta))};
  }

  static double Damping(const Params& p, double overlap, double r_eff, double m_eff) {
    return DampingOf(p.damping, kSecantShare * Stiffness(p, overlap, r_eff, m_eff), m_eff);
  }
  static GROUSER_HD float Dashpot(const Params& p, const ContactGeometry& g, float stiffness) {
    return p.damping * Sqrt(stiffness * g.m_eff);
  }
};

}  // namespace grouser::dem
