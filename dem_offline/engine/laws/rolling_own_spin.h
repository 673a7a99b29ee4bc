#pragma once

#include "dem_offline/engine/laws/law.h"

namespace grouser::dem {

/// Torque against each grain's own spin.
///   M = -mu_r R F_n w/|w|,  |M| <= kSpinShare I |w|/dt,  I = 2/5 m R^2
/// w [rad/s], R [m], m [kg]: spin, radius, mass of grain i itself. The two
/// torques of a pair differ, so angular momentum is not conserved and the two
/// sides of a contact do not mirror one another. The cap (law.h, kSpinShare) keeps
/// the torques of the contacts of a grain together from turning its spin round
/// within a step; see RollingConstant.
/// Source: McCarthy et al., Powder Technol. 203 (2010) 70, "R" and "R'".
/// History words: none. Bounds for the time step: none, by the cap. Energy:
/// rolling loss of this grain at its mean spin in the step, as of RollingConstant; the other side
/// adds its own.
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

  static Params Make(const Elastic&, const Elastic&, const ContactProperties& f, const Settings&) {
    return {static_cast<float>(f.rolling_friction)};
  }

  static constexpr double kStepShare = 0.2;
  static SpringBound Bounds(const Params&, double, double, double) { return {}; }
  static GROUSER_HD RollingTerms Evaluate(const Params& p, const ContactGeometry& g, Vec3f,
                                          const NormalTerms& normal, History&, float dt) {
    const float torque = p.friction * g.r_own * normal.grip;
    const float inertia = 0.4f * g.m_own * g.r_own * g.r_own;
    const float spin = Sqrt(Dot(g.w_own, g.w_own));
    const float share =
        spin > 0.0f ? Min(torque / Max(spin, 1e-30f), inertia * (kSpinShare / dt)) : 0.0f;
    const float part = 1.0f - 0.5f * share * dt / (3.5f * inertia);
    return {-share * g.w_own, share * spin * spin * dt * part, 0.0f};
  }
};

}  // namespace grouser::dem
