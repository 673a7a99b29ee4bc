#pragma once

#include "dem_offline/engine/laws/normal_hertz_spring.h"

namespace grouser::dem {

/// Hertz spring with a damper proportional to overlap and velocity.
///   F_n = 4/3 E* sqrt(R*) delta^(3/2) + beta delta d(delta)/dt
/// beta [kg/(m s)] must be given: up to engine version 4 this name stood for the
/// constant dashpot that is HertzDashpot now, so a file without beta is an old one.
/// The force starts from zero at touch; restitution falls with the impact speed
/// (1 - e^2 grows as v^(3/5) where it is small) and the restitution of the ContactProperties
/// is not used.
/// Source: Oden & Martins, Comput. Methods Appl. Mech. Eng. 52 (1985) 527, as in
/// McCarthy et al. 2010 (reference 3), eq. 8, version 2 "n".
/// Damping bound: beta delta. The rest as of HertzSpring.
struct HertzOdenMartins : HertzSpring<HertzOdenMartins> {
  static constexpr const char* kName = "hertz_oden_martins";
  struct Settings {
    double damping_kg_per_m_s = -1;  ///< beta; negative: not given
  };
  template <class S, class V>
  static void Fields(S& s, V&& v) {
    v("damping_kg_per_m_s", s.damping_kg_per_m_s);
  }
  struct Params {
    float e_star;  ///< E* [Pa]
    float beta;    ///< [kg/(m s)]
  };

  static Params Make(const Elastic& a, const Elastic& b, const ContactProperties&,
                     const Settings& s) {
    Require(s.damping_kg_per_m_s >= 0, "hertz_oden_martins.damping_kg_per_m_s",
            s.damping_kg_per_m_s, kChanged);
    return {static_cast<float>(EffectiveModulus(a, b)), static_cast<float>(s.damping_kg_per_m_s)};
  }
  static constexpr const char* kChanged =
      "a given beta >= 0: since engine version 5 hertz_oden_martins damps by beta a da/dt; the "
      "constant dashpot c da/dt, which had this name before, is hertz_dashpot";

  static double Damping(const Params& p, double overlap, double /*r_eff*/, double /*m_eff*/) {
    return p.beta * overlap;
  }
  static GROUSER_HD float Dashpot(const Params& p, const ContactGeometry& g, float /*stiffness*/) {
    return p.beta * g.overlap;
  }
};

}  // namespace grouser::dem
