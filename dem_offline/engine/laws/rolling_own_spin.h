#pragma once

#include "dem_offline/engine/laws/law.h"

namespace grouser::dem {

/// Torque against each grain's own spin.
///   M = -mu_r R F_n w/|w|,  |M| <= I |w|/dt,  I = 2/5 m R^2
/// w [rad/s], R [m], m [kg]: spin, radius, mass of grain i itself. The two
/// torques of a pair differ, so angular momentum is not conserved and the two
/// sides of a contact do not mirror one another. The cap stops the spin within
/// a step and no further; it holds for one contact at a time, so a grain with
/// several still flickers about rest.
/// Source: McCarthy et al., Powder Technol. 203 (2010) 70, "R" and "R'".
/// History words: none. Energy: rolling loss of this grain at its mean spin in
/// the step; the other side adds its own.
struct RollingOwnSpin {
  static constexpr const char* kName = "own_spin";
  static constexpr unsigned kNeeds = 0;
  static constexpr bool kOwnSides = true;
  struct Settings {};
  template <class S, class V>
  static void Fields(S&, V&&) {}
  struct Params {
    float friction;  ///< mu_r [-]
  };
  struct History {};

  static Params Make(const Elastic&, const Elastic&, const Interface& f, const Settings&) {
    return {static_cast<float>(f.rolling_friction)};
  }

  static GROUSER_HD RollingTerms Evaluate(const Params& p, const ContactGeometry& g, Vec3f,
                                          const NormalTerms& normal, History&, float dt) {
    const float torque = p.friction * g.r_own * normal.grip;
    const float inertia = 0.4f * g.m_own * g.r_own * g.r_own;
    const float spin = Sqrt(Dot(g.w_own, g.w_own));
    const float share = spin > 0.0f ? Min(torque / Max(spin, 1e-30f), inertia / dt) : 0.0f;
    const float part = 1.0f - 0.5f * share * dt / inertia;
    return {-share * g.w_own, share * spin * spin * dt * part, 0.0f};
  }
};

}  // namespace grouser::dem
