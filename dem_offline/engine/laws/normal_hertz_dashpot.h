#pragma once

#include "dem_offline/engine/laws/normal_hertz_spring.h"

namespace grouser::dem {

/// Hertz spring with a constant dashpot.
///   F_n = 4/3 E* sqrt(R*) delta^(3/2) + c d(delta)/dt,   c constant
/// c [N s/m] is given, or as a share zeta of critical damping at a reference
/// overlap delta_0 = s R*:
///   c = 2 zeta sqrt(k_0 m*),   k_0 = dF/d(delta)(delta_0) = 2 E* R* sqrt(s).
/// c beside zeta or s is refused; what is not given of these is kUsualShare and
/// kUsualOverlap.
/// The force jumps to c v at touch; restitution rises with the impact speed
/// and the restitution of the ContactProperties is not used.
/// Source: damped Hertz spring of Shin et al. 2020 (reference 1, nu_n); the share
/// at a reference overlap is ours.
/// Damping bound: c. The rest as of HertzSpring.
struct HertzDashpot : HertzSpring<HertzDashpot> {
  static constexpr const char* kName = "hertz_dashpot";
  static constexpr double kUsualShare = 0.1, kUsualOverlap = 0.01;
  struct Settings {
    double damping_n_s_per_m = 0;         ///< c; 0: from the share below
    double critical_damping_share = -1;   ///< zeta; negative: not given
    double reference_overlap_share = -1;  ///< s = delta_0/R*; negative: not given
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

  static Params Make(const Elastic& a, const Elastic& b, const ContactProperties&,
                     const Settings& s) {
    Require(s.damping_n_s_per_m >= 0, "damping_n_s_per_m", s.damping_n_s_per_m, ">= 0");
    Require(s.critical_damping_share <= 2, "critical_damping_share", s.critical_damping_share,
            "<= 2");
    Require(s.reference_overlap_share != 0, "reference_overlap_share", s.reference_overlap_share,
            "> 0");
    const bool given = s.damping_n_s_per_m > 0, share_given = s.critical_damping_share >= 0,
               overlap_given = s.reference_overlap_share > 0;
    RequireOne(given, "hertz_dashpot.damping_n_s_per_m", share_given,
               "hertz_dashpot.critical_damping_share");
    RequireOne(given, "hertz_dashpot.damping_n_s_per_m", overlap_given,
               "hertz_dashpot.reference_overlap_share");
    const double e_star = EffectiveModulus(a, b);
    const double share = overlap_given ? s.reference_overlap_share : kUsualOverlap;
    const double k_per_radius = 2 * e_star * __builtin_sqrt(share);
    const double zeta = share_given ? s.critical_damping_share : kUsualShare;
    return {static_cast<float>(e_star), static_cast<float>(s.damping_n_s_per_m),
            given ? 0.0f : static_cast<float>(2 * zeta * __builtin_sqrt(k_per_radius))};
  }

  static double Damping(const Params& p, double /*overlap*/, double r_eff, double m_eff) {
    return p.fixed + p.share * __builtin_sqrt(r_eff * m_eff);
  }
  static GROUSER_HD float Dashpot(const Params& p, const ContactGeometry& g, float /*stiffness*/) {
    return p.fixed + p.share * Sqrt(g.r_eff * g.m_eff);
  }
};

}  // namespace grouser::dem
