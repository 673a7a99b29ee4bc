#pragma once

#include "dem_offline/engine/laws/law.h"

namespace grouser::dem {

/// Elastic-plastic spring-dashpot rolling resistance (EPSD, model C).
///   M <- M - k_r w_t dt,   k_r = 2.25 k_n (mu_r R_r)^2
///   |M| > mu_r R_r F_n: M <- mu_r R_r F_n M/|M| (no damping)
///   else total = M - 2 eta sqrt(I_r k_r) w_t
/// w_t [rad/s]: angular velocity of i relative to its partner, without the
/// component along n (no resistance to spinning). R_r = R_i R_j/(R_i + R_j):
/// half a radius between equal grains, the full radius at a wall. k_n: secant
/// normal stiffness. I_r: reduced 7/5 m R^2.
/// Source: Ai, Chen, Rotter & Ooi, Powder Technol. 206 (2011) 269; the factor
/// 2.25: Iwashita & Oda 1998 as used there.
/// History words: 3. Energy: stored M^2/(2 k_r), rolling loss. The published
/// law keeps M while k_r changes with the overlap; what that takes from (or,
/// parting, gives to) the stored energy is counted as loss, with its sign.
struct RollingEpsd {
  static constexpr const char* kName = "epsd";
  static constexpr unsigned kNeeds = 0;
  static constexpr bool kOwnSides = false;
  struct Settings {};
  template <class S, class V>
  static void Fields(S&, V&&) {}
  struct Params {
    float friction;  ///< mu_r [-]
    float damping;   ///< eta [-]
  };
  struct History {
    Vec3f elastic;  ///< elastic moment on i [N m]
  };
  static constexpr unsigned kVectorWords = 0b111;

  static Params Make(const Elastic&, const Elastic&, const ContactProperties& f, const Settings&) {
    return {static_cast<float>(f.rolling_friction), static_cast<float>(f.rolling_damping)};
  }

  static constexpr double kStepShare = 1;
  static SpringBound Bounds(const Params& p, double stiffness, double r_eff, double roll_inertia) {
    const double arm = p.friction * r_eff, kr = 2.25 * stiffness * arm * arm;
    return {kr, DampingOf(2 * p.damping, kr, roll_inertia)};
  }
  static GROUSER_HD RollingTerms Evaluate(const Params& p, const ContactGeometry& g, Vec3f w_t,
                                          const NormalTerms& normal, History& h, float dt) {
    const float arm = p.friction * g.r_eff;
    const float kr = 2.25f * normal.stiffness * arm * arm;
    const float cap = arm * normal.grip;
    const Vec3f kept = TurnIntoPlane(h.elastic, g.n);
    const Vec3f trial = kept - (kr * dt) * w_t;
    const float size = Sqrt(Dot(trial, trial));
    const bool full = size > cap;
    const float scale = full ? cap / Max(size, 1e-30f) : 1.0f;
    h.elastic = scale * trial;
    const float c = full ? 0.0f : 2.0f * p.damping * Sqrt(g.roll_inertia * kr);
    const float flex = 1.0f / Max(kr, 1e-30f);
    RollingTerms out;
    out.moment = h.elastic - c * w_t;
    out.stored = 0.5f * flex * Dot(h.elastic, h.elastic);
    const float change = g.k_old > 0.0f ? normal.stiffness / Max(g.k_old, 1e-30f) - 1.0f : 0.0f;
    const float exchange = 0.5f * flex * Dot(kept, kept) * change;
    out.loss = exchange + 0.5f * flex * (1.0f - scale) * Dot(trial, kept + h.elastic) +
               c * Dot(w_t, w_t) * dt;
    return out;
  }
};

}  // namespace grouser::dem
