#pragma once

#include "dem_offline/engine/laws/law.h"

namespace grouser::dem {

/// Constant directional torque (Ai et al.'s model A).
///   M = -mu_r R_r F_n w_t/|w_t|;  0 at w_t = 0
/// w_t [rad/s]: angular velocity of i relative to its partner without the
/// component along n; R_r = R_i R_j/(R_i + R_j), the full radius at a wall (the
/// convention of RollingEpsd; other codes' differ by factors of 2 to 4). No
/// static part: the torque flips about zero and piles creep, as published.
/// Source: Ai, Chen, Rotter & Ooi, Powder Technol. 206 (2011) 269.
/// History words: none. Energy: rolling loss, taken at the mean spin of the
/// step (M changes w_t by M dt/I, I the reduced 2/5 m R^2), since near rest the
/// torque overshoots and gives some of it back.
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

  static Params Make(const Elastic&, const Elastic&, const Interface& f, const Settings&) {
    return {static_cast<float>(f.rolling_friction)};
  }

  static GROUSER_HD RollingTerms Evaluate(const Params& p, const ContactGeometry& g, Vec3f w_t,
                                          const NormalTerms& normal, History&, float dt) {
    const float torque = p.friction * g.r_eff * normal.grip;
    const float speed = Sqrt(Dot(w_t, w_t));
    const float share = speed > 0.0f ? torque / Max(speed, 1e-30f) : 0.0f;
    const float inertia = 2.0f / 7.0f * g.roll_inertia;
    const float part = 1.0f - 0.5f * share * dt / inertia;
    return {-share * w_t, share * speed * speed * dt * part, 0.0f};
  }
};

}  // namespace grouser::dem
