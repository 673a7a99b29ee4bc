#pragma once

#include "dem_offline/engine/laws/material.h"

namespace grouser::dem {

/// Linear spring and dashpot.
///   F_n = k_n delta + 2 zeta sqrt(k_n m*) d(delta)/dt
/// k_n [N/m] is a constant, or scaled from the materials as in LS-DYNA:
///   k_n = NORMK k1 r1 k2 r2/(k1 r1 + k2 r2),  k = E/(3 (1 - 2 nu)),
/// at a rigid partner NORMK k1 r1. zeta from the restitution e,
/// zeta = -ln e/sqrt(ln^2 e + pi^2), or given as NDAMP. The damping is not cut
/// off where it makes the sum attractive: e is exact at every speed.
/// Source: Cundall & Strack 1979; LS-DYNA manual, *CONTROL_DISCRETE_ELEMENT.
/// Interaction range: overlap > 0. History words: none. radius is sqrt(R* delta),
/// a name only: the law has no contact radius to promise. Energy: stored,
/// normal damping.
struct LinearSpring {
  static constexpr const char* kName = "linear_spring";
  static constexpr unsigned kProvides = 0, kNeeds = 0;
  static constexpr double kUsualNormk = 0.01;
  struct Settings {
    double stiffness_n_per_m = 0;        ///< k_n; 0: from NORMK
    double normk = -1;                   ///< instead of it; negative: kUsualNormk
    double critical_damping_share = -1;  ///< zeta (NDAMP); negative: from the restitution
  };
  template <class S, class V>
  static void Fields(S& s, V&& v) {
    v("stiffness_n_per_m", s.stiffness_n_per_m);
    v("normk", s.normk);
    v("critical_damping_share", s.critical_damping_share);
  }
  /// Compliance 1/k_n = flex + own/r_own + other/r_other.
  struct Params {
    float flex;        ///< [m/N]
    float own, other;  ///< 1/(NORMK k) [m^2/N], 0 where rigid
    float damping;     ///< 2 zeta [-]
  };
  struct History {};

  static Params Make(const Elastic& a, const Elastic& b, const ContactProperties& f,
                     const Settings& s) {
    const double zeta = s.critical_damping_share;
    Require(zeta <= 2, "critical_damping_share", zeta, "<= 2");
    Require(s.stiffness_n_per_m >= 0, "stiffness_n_per_m", s.stiffness_n_per_m, ">= 0");
    const float damping =
        static_cast<float>(2 * (zeta < 0 ? LinearDampingRatio(f.restitution) : zeta));
    RequireOne(s.stiffness_n_per_m > 0, "linear_spring.stiffness_n_per_m", s.normk > 0,
               "linear_spring.normk");
    if (s.stiffness_n_per_m > 0) {
      return {static_cast<float>(1 / s.stiffness_n_per_m), 0.0f, 0.0f, damping};
    }
    Require(s.normk != 0, "normk", s.normk, "> 0");
    const double normk = s.normk > 0 ? s.normk : kUsualNormk;
    const auto compliance = [&](const Elastic& m) {
      return static_cast<float>(3 * (1 - 2 * m.poisson_ratio) / m.youngs_modulus_pa / normk);
    };
    const Params p = {0.0f, compliance(a), compliance(b), damping};
    Require(p.own + p.other > 0, "poisson_ratio", a.poisson_ratio,
            "< 0.5 in one of the materials (NORMK scales the bulk modulus)");
    return p;
  }

  static constexpr double kSecantShare = 1;
  /// Over all pairs of radii with this r_eff.
  static double Stiffness(const Params& p, double /*overlap*/, double r_eff, double /*m_eff*/) {
    const double low = p.own < p.other ? p.own : p.other, high = p.own < p.other ? p.other : p.own;
    return 1 / (p.flex + (low > 0 ? low : high) / r_eff);
  }
  static double Damping(const Params& p, double overlap, double r_eff, double m_eff) {
    return DampingOf(p.damping, Stiffness(p, overlap, r_eff, m_eff), m_eff);
  }

  static GROUSER_HD NormalTerms Evaluate(const Params& p, const ContactGeometry& g,
                                         float overlap_rate, History&, float) {
    const float k = 1.0f / (p.flex + (p.own / g.r_own + p.other / g.r_other));
    const float c = p.damping * Sqrt(k * g.m_eff);
    NormalTerms out;
    out.force = k * g.overlap + c * overlap_rate;
    out.grip = Max(out.force, 0.0f);
    out.stiffness = k;
    out.radius = Sqrt(g.r_eff * g.overlap);
    out.damping_power = c * overlap_rate * overlap_rate;
    out.stored = 0.5f * k * g.overlap * g.overlap;
    out.plastic = 0.0f;
    return out;
  }
};

}  // namespace grouser::dem
