#pragma once

#include "dem_offline/engine/laws/law.h"

namespace grouser::dem {

/// Constant directional torque (Ai et al.'s model A).
///   M = -mu_r R_r F_n w_t/|w_t|,  |M| <= kSpinShare I |w_t|/dt;  0 at w_t = 0
/// w_t [rad/s]: angular velocity of i relative to its partner without the
/// component along n; R_r = R_i R_j/(R_i + R_j), the full radius at a wall (the
/// convention of RollingEpsd; other codes' differ by factors of 2 to 4); I: the
/// reduced 2/5 m R^2 [kg m^2]. No static part: piles creep, as published.
/// Near rest the cap holds (law.h, kSpinShare): a torque that turned the spin
/// round would flip in every step, heat the bed and book many times the work done.
/// The cap is a dashpot that grows stronger as the step is made shorter, so the
/// law asks for a shorter step than stability does (kStepShare).
/// Source: Ai, Chen, Rotter & Ooi, Powder Technol. 206 (2011) 269; the cap is ours.
/// History words: none. Bounds for the time step: none, by the cap. Energy:
/// rolling loss at the mean spin of the step, of grains that roll without
/// sliding (M changes w_t by M dt over the reduced 7/5 m R^2).
struct RollingConstant {
  static constexpr const char* kName = "constant_torque";
  static constexpr unsigned kNeeds = 0;
  static constexpr bool kOwnSides = false;
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

  static constexpr double kStepShare = 0.4;
  static SpringBound Bounds(const Params&, double, double, double) { return {}; }
  static GROUSER_HD RollingTerms Evaluate(const Params& p, const ContactGeometry& g, Vec3f w_t,
                                          const NormalTerms& normal, History&, float dt) {
    const float torque = p.friction * g.r_eff * normal.grip;
    const float speed = Sqrt(Dot(w_t, w_t));
    const float cap = 2.0f / 7.0f * g.roll_inertia * (kSpinShare / dt);
    const float share = speed > 0.0f ? Min(torque / Max(speed, 1e-30f), cap) : 0.0f;
    const float part = 1.0f - 0.5f * share * dt / g.roll_inertia;
    return {-share * w_t, share * speed * speed * dt * part, 0.0f};
  }
};

}  // namespace grouser::dem
