#pragma once

#include "dem_offline/engine/core/math.h"
#include "dem_offline/engine/laws/material.h"

namespace grouser::dem {

/// Adhesive elastic spheres (Johnson, Kendall, Roberts), exact.
///   delta = a^2/R* - d sqrt(a),  d = sqrt(2 pi gamma/E*)
///   F = 4 E* a^3/(3 R*) - 2 E* d a^(3/2)          (2 E* d = sqrt(8 pi gamma E*))
/// a [m]: contact radius, the stable branch; gamma [J/m^2]: work of adhesion.
/// With a_m = (d R*/4)^(2/3) and a = a_m s^2 this is s^4 - 4 s = delta R*/a_m^2,
/// s >= 1, solved by Ferrari's resolvent y^3 + Delta y = 2, which stays well
/// conditioned down to the snap-off at delta_s = -3 a_m^2/R* =
/// -(3/4)(pi^2 gamma^2 R*/E*^2)^(1/3). Pull-off force 3/2 pi gamma R*.
/// It takes the place of the Hertz elastic force and leaves the damping force
/// as it is; the neck (delta < 0, after touching only) is undamped.
/// Grip = F + 2 pull-off (Thornton & Yin 1991). radius = a, stiffness = 4/3 E* a.
/// Energy, zero when apart, of work d(delta) = F:
///   U(a) = 8 E* a^5/(15 R*^2) - 4/3 E* d a^(7/2)/R* + 1/2 E* d^2 a^2
/// loss on touching -U(s^3 = 4), on snapping U(s = 1).
/// Source: Johnson, Kendall & Roberts, Proc. R. Soc. A 324 (1971) 301.
/// Interaction range: -delta_s. History words: 1.
struct Jkr {
  static constexpr const char* kName = "jkr";
  static constexpr unsigned kNeeds = kHertzElastic;
  static constexpr bool kHasRange = true;
  struct Settings {};
  template <class S, class V>
  static void Fields(S&, V&&) {}
  struct Params {
    float e_star;  ///< E* [Pa]
    float d;       ///< sqrt(2 pi gamma/E*) [sqrt(m)]
  };
  struct History {
    float neck;  ///< 1: has touched and not yet snapped
  };
  static constexpr unsigned kVectorWords = 0;

  static Params Make(const Elastic& a, const Elastic& b, const ContactProperties& f,
                     const Settings&) {
    const double e_star = EffectiveModulus(a, b);
    return {static_cast<float>(e_star),
            static_cast<float>(
                __builtin_sqrt(2 * 3.14159265358979323846 * f.surface_energy_j_per_m2 / e_star))};
  }
  /// -delta_s of the largest r_eff, that of the largest grain at a body [m].
  static double Range(const Params& p, double, double largest) {
    const double a_m = __builtin_cbrt(p.d * p.d * largest * largest / 16);
    return 1.0001 * 3 * a_m * a_m / largest;
  }

  /// s >= 1 with s^4 - 4 s = x, for x in [-3, 1e10].
  static GROUSER_HD float Root(float x) {
    // Newton from above: y^3 + x y - 2 is convex and rising there.
    float y = x > 0.0f ? Min(1.26f, 2.0f / Max(x, 1e-6f)) : 2.0f;
    for (int i = 0; i < 6; ++i) y = (2.0f * y * y * y + 2.0f) / (3.0f * y * y + x);
    const float z = Sqrt(2.0f * y);
    return 0.5f * (z + Sqrt(Max(4.0f * (2.0f / z) - z * z, 0.0f)));
  }

  /// What the wider contact adds: dF/d(delta) = 2 E* a (q - 3)/(q - 1) with
  /// q = (a/a_m)^(3/2), under 2 E* a of the JKR radius [N/m].
  static double Stiffness(const Params& p, double overlap, double r_eff) {
    const double a_m = __builtin_cbrt(p.d * p.d * r_eff * r_eff / 16);
    const double hertz = __builtin_sqrt(r_eff * overlap), x = overlap * r_eff / (a_m * a_m);
    if (!(x < 1e10)) return 0;
    const double s = Root(static_cast<float>(x));
    return 2 * p.e_star * (a_m * s * s - hertz);
  }

  static GROUSER_HD CohesionTerms Evaluate(const Params& p, const ContactGeometry& g,
                                           NormalTerms& normal, History& h, float) {
    const float r = g.r_eff;
    const float root = Cbrt(0.25f * p.d * r), a_m = root * root;
    const float snap = -3.0f * a_m * a_m / r;
    const bool had = h.neck > 0.5f;
    const bool active = g.overlap > 0.0f || (had && g.overlap > snap);
    const float x = g.overlap * r / Max(a_m * a_m, 1e-36f);
    const float s = Root(Max(Min(x, 1e10f), -3.0f));
    // Beyond 1e10 adhesion lies below the rounding: Hertz.
    const float a = x < 1e10f ? a_m * s * s : Sqrt(r * Max(g.overlap, 0.0f));
    const float stiffness = 4.0f / 3.0f * p.e_star * a;
    const float pull = 2.0f * p.e_star * p.d * a * Sqrt(a);
    const float damping = normal.force - normal.stiffness * g.overlap;
    const float force = stiffness * (a * a / r) - pull + (g.overlap > 0.0f ? damping : 0.0f);
    const float pull_off = 0.75f * p.e_star * p.d * p.d * r;
    const float push_energy = 0.4f * stiffness * (a * a / r) * (a * a / r);
    const float pull_energy = (2.0f / 3.0f) * pull * (a * a / r);
    const float surface = 0.5f * p.e_star * p.d * p.d * a * a;
    normal.force = active ? force : 0.0f;
    normal.grip = active ? Max(force + 2.0f * pull_off, 0.0f) : 0.0f;
    normal.stiffness = active ? stiffness : 0.0f;
    normal.radius = active ? a : 0.0f;
    normal.stored = active ? push_energy - pull_energy + surface : 0.0f;
    // U(s^3 = 4) and U(1), in units of E* a_m^5/R*^2.
    const float unit = p.e_star * a_m * a_m * (a_m / r) * a_m * (a_m / r);
    CohesionTerms out;
    out.active = active;
    out.loss = active == had ? 0.0f : (active ? 30.478100f : 3.2f) * unit;
    h.neck = active ? 1.0f : 0.0f;
    return out;
  }
};

}  // namespace grouser::dem
