#pragma once

#include "dem_offline/engine/core/math.h"
#include "dem_offline/engine/laws/material.h"

namespace grouser::dem {

/// Elastic, perfectly plastic spheres after Thornton.
///   loading   F = k_h delta^(3/2),              delta <= delta_y, k_h = 4/3 E* sqrt(R*)
///             F = F_y + k_y (delta - delta_y),  beyond; k_y = 3/2 F_y/delta_y
///   unloading F = k_h sqrt(rho) (delta - delta_p)^(3/2), reloading the same way to F_max
///   rho = R_p/R* = (F_y/F_max) ((2 F_max + F_y)/(3 F_y))^(3/2)
///   delta_p = delta_max - (F_max/(k_h sqrt(rho)))^(2/3)
/// F_y [N]: yield force of the contact (a setting); delta_y = (F_y/k_h)^(2/3);
/// delta_p: the overlap that stays. Optional dashpot: zeta of critical damping
/// of the elastic tangent 2 E* a, a = sqrt(R_p (delta - delta_p)).
/// Source: Thornton, J. Appl. Mech. 64 (1997) 383, in force form as in McCarthy
/// et al. 2010, version 1 "N" and "D". The unloading curve printed in the
/// latter gives energy back (e = 1.22 at yield) and is not used.
/// A contact that parts forgets its flattening. Interaction range: overlap > 0
/// (force only above delta_p). History words: 2. stiffness is
/// F/(delta - delta_p) = 4/3 E* a, radius a. Energy: stored 2/5 F (delta -
/// delta_p), plastic = work to delta_max less what unloading returns.
struct ElastoPlastic {
  static constexpr const char* kName = "elasto_plastic";
  static constexpr unsigned kProvides = kHertzRadius, kNeeds = 0;
  struct Settings {
    double yield_force_n = 48;          ///< F_y; 48 N: 4.76 mm steel balls of McCarthy et al.
    double critical_damping_share = 0;  ///< zeta
  };
  template <class S, class V>
  static void Fields(S& s, V&& v) {
    v("yield_force_n", s.yield_force_n);
    v("critical_damping_share", s.critical_damping_share);
  }
  struct Params {
    float e_star;       ///< E* [Pa]
    float yield_force;  ///< F_y [N]
    float damping;      ///< 2 zeta [-]
  };
  struct History {
    float overlap;  ///< delta_max [m]
    float spent;    ///< plastic work so far [J]
  };
  static constexpr unsigned kVectorWords = 0;

  static Params Make(const Elastic& a, const Elastic& b, const ContactProperties&,
                     const Settings& s) {
    Require(s.yield_force_n > 0, "yield_force_n", s.yield_force_n, "> 0");
    Require(s.critical_damping_share >= 0 && s.critical_damping_share <= 2,
            "critical_damping_share", s.critical_damping_share, "in [0, 2]");
    return {static_cast<float>(EffectiveModulus(a, b)), static_cast<float>(s.yield_force_n),
            static_cast<float>(2 * s.critical_damping_share)};
  }

  static constexpr double kSecantShare = 2.0 / 3;
  /// At the start of unloading from `overlap`, the largest.
  static double Stiffness(const Params& p, double overlap, double r_eff, double /*m_eff*/) {
    const double kh = 4.0 / 3 * p.e_star * __builtin_sqrt(r_eff);
    const double fy = p.yield_force, root = __builtin_cbrt(fy / kh), dy = root * root;
    if (overlap <= dy) return 1.5 * kh * __builtin_sqrt(overlap);
    const double f = fy + 1.5 * fy / dy * (overlap - dy), y = (2 * f / fy + 1) / 3;
    const double flat = kh * __builtin_sqrt(fy / f * y * __builtin_sqrt(y));
    return 1.5 * flat * __builtin_cbrt(f / flat);
  }
  static double Damping(const Params& p, double overlap, double r_eff, double m_eff) {
    return DampingOf(p.damping, Stiffness(p, overlap, r_eff, m_eff), m_eff);
  }

  static GROUSER_HD NormalTerms Evaluate(const Params& p, const ContactGeometry& g,
                                         float overlap_rate, History& h, float) {
    const float kh = 4.0f / 3.0f * p.e_star * Sqrt(g.r_eff);
    const float fy = p.yield_force;
    const float root_y = Cbrt(fy / kh), dy = root_y * root_y;
    const float deepest = Max(h.overlap, g.overlap);
    const float beyond = Max(deepest - dy, 0.0f);
    const bool yielded = beyond > 0.0f;
    const float ky = 1.5f * fy / dy;
    const float most = fy + ky * beyond;  // F_max, once yielded
    const float y = (2.0f * most / fy + 1.0f) * (1.0f / 3.0f);
    const float rho = yielded ? fy / most * y * Sqrt(y) : 1.0f;
    const float flat = kh * Sqrt(rho);
    const float root_e = Cbrt(most / flat), elastic_most = root_e * root_e;
    const float stays = yielded ? Max(deepest - elastic_most, 0.0f) : 0.0f;
    const float elastic = Max(g.overlap - stays, 0.0f);
    const float stiffness = flat * Sqrt(elastic);
    const float spent =
        Max(0.4f * fy * dy + fy * beyond + 0.5f * ky * beyond * beyond - 0.4f * most * elastic_most,
            h.spent);
    const float c = p.damping * Sqrt(1.5f * stiffness * g.m_eff);
    NormalTerms out;
    out.force = stiffness * elastic + c * overlap_rate;
    out.grip = Max(out.force, 0.0f);
    out.stiffness = stiffness;
    out.radius = Sqrt(rho * g.r_eff * elastic);
    out.damping_power = c * overlap_rate * overlap_rate;
    out.stored = 0.4f * stiffness * elastic * elastic;
    out.plastic = yielded ? spent - h.spent : 0.0f;
    h.overlap = deepest;
    h.spent = yielded ? spent : h.spent;
    return out;
  }
};

}  // namespace grouser::dem
