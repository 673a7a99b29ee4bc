#pragma once

#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/laws/tangential_spring.h"

namespace grouser::dem {

/// Linear spring with history, dashpot and Coulomb's cap.
///   k_t = q k_n,   c = 2 TDAMP sqrt(k_t m*),   |F| <= mu F_n
/// k_n [N/m]: secant stiffness of the normal law (constant for linear springs);
/// q: SHEARK of LS-DYNA, 2/7 by default, or Mindlin's ratio of the materials,
/// 4 G*/E* = 2 (1 - nu)/(2 - nu) for equal ones. Kept as a force and rescaled
/// when k_n falls, so that no path makes energy (tangential_spring.h). With a
/// Hertz spring q multiplies the secant, 2/3 of the tangent.
/// Source: Cundall & Strack, Geotechnique 29 (1979) 47; LS-DYNA manual.
/// History words: 3. Energy: stored, tangential damping, slip.
struct LinearHistory {
  static constexpr const char* kName = "linear_history";
  static constexpr unsigned kNeeds = 0;
  struct Settings {
    double stiffness_ratio = 2.0 / 7;     ///< q; 0: Mindlin's
    double critical_damping_share = 0.0;  ///< TDAMP
  };
  template <class S, class V>
  static void Fields(S& s, V&& v) {
    v("stiffness_ratio", s.stiffness_ratio);
    v("critical_damping_share", s.critical_damping_share);
  }
  struct Params {
    float ratio;     ///< q [-]
    float damping;   ///< 2 TDAMP [-]
    float friction;  ///< mu [-]
  };
  struct History {
    Vec3f elastic;  ///< elastic force on i [N]
  };
  static constexpr unsigned kVectorWords = 0b111;

  static Params Make(const Elastic& a, const Elastic& b, const ContactProperties& f,
                     const Settings& s) {
    Require(s.stiffness_ratio >= 0, "stiffness_ratio", s.stiffness_ratio, ">= 0");
    Require(s.critical_damping_share >= 0 && s.critical_damping_share <= 2,
            "critical_damping_share", s.critical_damping_share, "in [0, 2]");
    const double q = s.stiffness_ratio > 0
                         ? s.stiffness_ratio
                         : 4 * EffectiveShearModulus(a, b) / EffectiveModulus(a, b);
    return {static_cast<float>(q), static_cast<float>(2 * s.critical_damping_share),
            static_cast<float>(f.friction)};
  }

  static SpringBound Bounds(const Params& p, double stiffness, double m_eff) {
    return {p.ratio * stiffness, DampingOf(p.damping * __builtin_sqrt(p.ratio), stiffness, m_eff)};
  }
  static GROUSER_HD TangentialTerms Evaluate(const Params& p, const ContactGeometry& g, Vec3f v_t,
                                             const NormalTerms& normal, History& h, float dt) {
    const float kt = p.ratio * normal.stiffness;
    return StepSpring(kt, p.ratio * g.k_old, p.friction * normal.grip,
                      p.damping * Sqrt(kt * g.m_eff), g, v_t, dt, h.elastic);
  }
};

}  // namespace grouser::dem
