#pragma once

#include "dem_offline/engine/laws/normal_hertz.h"

namespace grouser::dem {

/// What a rolling law returns.
struct RollingTerms {
  Vec3f moment;   ///< on grain i [N m]
  Vec3f elastic;  ///< new history [N m]
  float loss;     ///< dissipated in this step [J]; see below
  float stored;   ///< [J]
};

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
  struct Params {
    float friction;  ///< mu_r [-]
    float damping;   ///< eta [-]
  };

  static GROUSER_HD RollingTerms Evaluate(const Params& p, Vec3f history, Vec3f n, Vec3f w_t,
                                          const NormalTerms& normal, float a_old,
                                          float roll_radius, float roll_inertia, float dt) {
    const float arm = p.friction * roll_radius;
    const float kr = 2.25f * normal.stiffness * arm * arm;
    const float cap = arm * Max(normal.force, 0.0f);
    const Vec3f kept = TurnIntoPlane(history, n);
    const Vec3f trial = kept - (kr * dt) * w_t;
    const float size = Sqrt(Dot(trial, trial));
    const bool full = size > cap;
    const float scale = full ? cap / Max(size, 1e-30f) : 1.0f;
    RollingTerms out;
    out.elastic = scale * trial;
    const float c = full ? 0.0f : 2.0f * p.damping * Sqrt(roll_inertia * kr);
    out.moment = out.elastic - c * w_t;
    out.stored = 0.5f * Dot(out.elastic, out.elastic) / Max(kr, 1e-30f);
    const float change = a_old > 0.0f ? normal.radius / Max(a_old, 1e-30f) - 1.0f : 0.0f;
    const float exchange = 0.5f * Dot(kept, kept) / Max(kr, 1e-30f) * change;
    out.loss = exchange + (full ? (size - cap) * cap / Max(kr, 1e-30f) : 0.0f) + c * Dot(w_t, w_t) * dt;
    return out;
  }
};

}  // namespace grouser::dem
