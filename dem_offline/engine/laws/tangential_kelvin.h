#pragma once

#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/laws/tangential_spring.h"

namespace grouser::dem {

/// Regularised Kelvin element: spring and dashpot in parallel, capped by a
/// friction that falls from sticking to sliding.
///   k_t = q k_n,  c = 2 zeta sqrt(k_t m*),  |F| <= mu(v) F_n,  v = |v_t|
///   mu(v) = mu_stick + (mu_slide - mu_stick) min(v/v_s, 1)
/// k_n [N/m]: secant stiffness of the normal law; v_s [m/s]: sticking
/// velocity. Spring kept as a force, rescaled when k_n falls.
/// Source: the 2-D grouser wheel of reference 4 (Toyoura sand): sticking tan 27
/// deg, sliding tan 25 deg, 10 % of critical. Its two constants 0.2 and 0.0025
/// have lost their symbols; read here as 0.0025 m/s. The straight fall between
/// the two frictions is ours.
/// History words: 3. Energy: stored, tangential damping, slip.
struct KelvinRegularised {
  static constexpr const char* kName = "kelvin_regularised";
  static constexpr unsigned kNeeds = 0;
  struct Settings {
    double stick_friction = -1;              ///< negative: the interface's friction
    double slide_friction = -1;              ///< negative: the interface's friction
    double sticking_speed_m_per_s = 0.0025;  ///< v_s
    double critical_damping_share = 0.1;     ///< zeta
    double stiffness_ratio = 0;              ///< q; 0: Mindlin's, 4 G*/E*
  };
  template <class S, class V>
  static void Fields(S& s, V&& v) {
    v("stick_friction", s.stick_friction);
    v("slide_friction", s.slide_friction);
    v("sticking_speed_m_per_s", s.sticking_speed_m_per_s);
    v("critical_damping_share", s.critical_damping_share);
    v("stiffness_ratio", s.stiffness_ratio);
  }
  struct Params {
    float ratio;    ///< q [-]
    float damping;  ///< 2 zeta [-]
    float stick;    ///< mu_stick [-]
    float fall;     ///< mu_stick - mu_slide [-]
    float speed;    ///< v_s [m/s]
  };
  struct History {
    Vec3f elastic;  ///< elastic force on i [N]
  };
  static constexpr unsigned kVectorWords = 0b111;

  static Params Make(const Elastic& a, const Elastic& b, const ContactProperties& f,
                     const Settings& s) {
    const double stick = s.stick_friction < 0 ? f.friction : s.stick_friction;
    const double slide = s.slide_friction < 0 ? f.friction : s.slide_friction;
    Require(slide <= stick, "slide_friction", slide, "<= stick_friction");
    Require(s.sticking_speed_m_per_s > 0, "sticking_speed_m_per_s", s.sticking_speed_m_per_s,
            "> 0");
    Require(s.critical_damping_share >= 0 && s.critical_damping_share <= 2,
            "critical_damping_share", s.critical_damping_share, "in [0, 2]");
    Require(s.stiffness_ratio >= 0, "stiffness_ratio", s.stiffness_ratio, ">= 0");
    const double q = s.stiffness_ratio > 0
                         ? s.stiffness_ratio
                         : 4 * EffectiveShearModulus(a, b) / EffectiveModulus(a, b);
    return {static_cast<float>(q), static_cast<float>(2 * s.critical_damping_share),
            static_cast<float>(stick), static_cast<float>(stick - slide),
            static_cast<float>(s.sticking_speed_m_per_s)};
  }

  static SpringBound Bounds(const Params& p, double stiffness, double m_eff) {
    return {p.ratio * stiffness, DampingOf(p.damping * __builtin_sqrt(p.ratio), stiffness, m_eff)};
  }
  static GROUSER_HD TangentialTerms Evaluate(const Params& p, const ContactGeometry& g, Vec3f v_t,
                                             const NormalTerms& normal, History& h, float dt) {
    const float kt = p.ratio * normal.stiffness;
    const float mu = p.stick - p.fall * Min(Sqrt(Dot(v_t, v_t)) / p.speed, 1.0f);
    return StepSpring(kt, p.ratio * g.k_old, mu * normal.grip, p.damping * Sqrt(kt * g.m_eff), g,
                      v_t, dt, h.elastic);
  }
};

}  // namespace grouser::dem
