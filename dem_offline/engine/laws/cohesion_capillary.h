#pragma once

#include "dem_offline/engine/laws/material.h"

namespace grouser::dem {

/// Pendular liquid bridge.
///   F = -2 pi R sigma cos(theta)/(1 + 1.05 S + 2.5 S^2),  S = D sqrt(R/V)
///   ruptures at D_r = (1 + theta/2) V^(1/3)
/// D [m]: gap, 0 while the grains overlap; R = 2 R* (harmonic mean radius; twice
/// the radius at a wall); sigma [N/m]: surface tension; theta [rad]: contact
/// angle; V [m^3]: volume of the bridge, absolute or a share of R*^3. A bridge
/// forms on touching, keeps its volume, and ruptures beyond D_r.
/// Valid for V up to about 0.1 R^3 and theta below 50 degrees. No viscosity.
/// Source: force: Willett, Adams, Johnson & Seville, Langmuir 16 (2000) 9396
/// (their closed form, in the whole gap); rupture: Lian, Thornton & Adams, J.
/// Colloid Interface Sci. 161 (1993) 138.
/// Friction feels the compression of the grains, not the pull of the liquid:
/// grip stays. Interaction range: D_r. History words: 1. Energy: stored
/// -integral of the pull from D to D_r (0 at D_r); on touching the whole
/// integral is lost; breaking loses nothing more.
struct Capillary {
  static constexpr const char* kName = "capillary";
  static constexpr unsigned kNeeds = 0;
  static constexpr bool kHasRange = true;
  struct Settings {
    double surface_tension_n_per_m = 0.072;  ///< sigma; water
    double contact_angle_rad = 0.0;          ///< theta
    double bridge_volume_m3 = 0.0;           ///< V; 0: from the share
    double bridge_volume_share = 0.01;       ///< V/R*^3
  };
  template <class S, class V>
  static void Fields(S& s, V&& v) {
    v("surface_tension_n_per_m", s.surface_tension_n_per_m);
    v("contact_angle_rad", s.contact_angle_rad);
    v("bridge_volume_m3", s.bridge_volume_m3);
    v("bridge_volume_share", s.bridge_volume_share);
  }
  /// V^(1/3) = fixed + share R*.
  struct Params {
    float pull;     ///< 4 pi sigma cos(theta) [N/m]
    float stretch;  ///< D_r/V^(1/3) [-]
    float fixed;    ///< [m]
    float share;    ///< [-]
  };
  struct History {
    float wet;  ///< 1: a bridge is there
  };
  static constexpr unsigned kVectorWords = 0;

  static Params Make(const Elastic&, const Elastic&, const ContactProperties&, const Settings& s) {
    Require(s.surface_tension_n_per_m >= 0, "surface_tension_n_per_m", s.surface_tension_n_per_m,
            ">= 0");
    Require(s.contact_angle_rad >= 0 && s.contact_angle_rad < 1.5707, "contact_angle_rad",
            s.contact_angle_rad, "in [0, pi/2)");
    Require(s.bridge_volume_m3 >= 0, "bridge_volume_m3", s.bridge_volume_m3, ">= 0");
    const bool fixed = s.bridge_volume_m3 > 0;
    Require(fixed || s.bridge_volume_share > 0, "bridge_volume_share", s.bridge_volume_share,
            "> 0, or bridge_volume_m3 > 0");
    return {static_cast<float>(4 * 3.14159265358979323846 * s.surface_tension_n_per_m *
                               __builtin_cos(s.contact_angle_rad)),
            static_cast<float>(1 + 0.5 * s.contact_angle_rad),
            fixed ? static_cast<float>(__builtin_cbrt(s.bridge_volume_m3)) : 0.0f,
            fixed ? 0.0f : static_cast<float>(__builtin_cbrt(s.bridge_volume_share))};
  }
  static double Range(const Params& p, double, double largest) {
    return 1.0001 * p.stretch * (p.fixed + p.share * largest);
  }
  static double Stiffness(const Params&, double, double) { return 0; }

  /// Integral of 1/(1 + 1.05 x + 2.5 x^2) from 0 to x. With x = t/(1 - t) the
  /// integrand is 1/(1 - 0.95 t + 2.45 t^2): Gauss with 5 points, error < 1e-4.
  static GROUSER_HD float Work(float x) {
    const float at[5] = {0.0469100770f, 0.2307653449f, 0.5f, 0.7692346551f, 0.9530899230f};
    const float weight[5] = {0.1184634425f, 0.2393143352f, 0.2844444444f, 0.2393143352f,
                             0.1184634425f};
    const float end = x / (1.0f + x);
    float sum = 0.0f;
    for (int i = 0; i < 5; ++i) {
      const float t = end * at[i];
      sum += weight[i] / (1.0f - 0.95f * t + 2.45f * t * t);
    }
    return end * sum;
  }

  static GROUSER_HD CohesionTerms Evaluate(const Params& p, const ContactGeometry& g,
                                           NormalTerms& normal, History& h, float) {
    const float edge = p.fixed + p.share * g.r_eff;  // V^(1/3)
    const float rupture = p.stretch * edge;
    const bool had = h.wet > 0.5f;
    const float gap = Max(-g.overlap, 0.0f);
    const bool active = g.overlap > 0.0f || (had && gap < rupture);
    const float scale = Sqrt(2.0f * g.r_eff / edge) / edge;  // S/D
    const float s = gap * scale;
    const float most = p.pull * g.r_eff;
    const float pull = most / (1.0f + 1.05f * s + 2.5f * s * s);
    const float all = most / scale * Work(rupture * scale);
    const float left = all - most / scale * Work(s) + most * Max(g.overlap, 0.0f);
    normal.force = active ? normal.force - pull : 0.0f;
    normal.stored = active ? normal.stored - left : 0.0f;
    CohesionTerms out;
    out.active = active;
    out.loss = active && !had ? all : 0.0f;
    h.wet = active ? 1.0f : 0.0f;
    return out;
  }
};

}  // namespace grouser::dem
