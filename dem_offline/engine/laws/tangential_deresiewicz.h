#pragma once

#include "dem_offline/engine/core/math.h"
#include "dem_offline/engine/laws/material.h"

namespace grouser::dem {

/// Mindlin-Deresiewicz with partial slip, incremental (Walton, Vu-Quoc).
///   dT = k_t0 theta ds +- mu (1 - theta) dF,  minus only when unloading;  k_t0 = 8 G* a
///   loading    theta^3 = 1 - (T + mu dF)/(mu F)
///   unloading  theta^3 = 1 - (T* - T + 2 mu dF)/(2 mu F)
///   reloading  theta^3 = 1 - (T - T** + 2 mu dF)/(2 mu F)
///   theta = 1 while F grows by more than k_t0 |ds|/mu
/// T [N]: tangential force along an axis; s [m]: displacement; F [N]:
/// compression; T*, T**: force at the last turn from loading and from
/// unloading, which follow the normal force: T* += mu dF, T** -= mu dF.
/// Source: Mindlin & Deresiewicz 1953; Thornton & Yin, Powder Technol. 65
/// (1991) 153; Vu-Quoc & Zhang 1999; McCarthy et al. 2010, "F".
/// In three dimensions (ours) the axis is the direction of T while loading and
/// stays that of the turn until loading resumes, at T* or beyond -T*; across
/// it the spring is elastic, k_t0; |T| <= mu F. Turning points inside a loop
/// that is itself inside a loop are forgotten.
/// Increments of this kind can make energy (where the direction changes). So
/// the energy put in is carried along, T is shortened where 1/2 T^2/k_t0 would
/// exceed it, and what goes beyond 1.26 times that of T or T*, the most that
/// partial slip can return, is slip. Nothing comes out that was not put in.
/// Against exact partial slip: 3e-3 of mu F on paths with one loop and changing
/// F; oblique impacts 0.01 in tangential restitution, 0.05 at 5 degrees.
/// History words: 11. Energy: stored as carried, slip the rest of the work.
struct MindlinDeresiewicz {
  static constexpr const char* kName = "mindlin_deresiewicz";
  static constexpr unsigned kNeeds = kHertzRadius;
  struct Settings {};
  template <class S, class V>
  static void Fields(S&, V&&) {}
  struct Params {
    float ratio;     ///< k_t0 over the secant normal stiffness 4/3 E* a: 6 G*/E* [-]
    float friction;  ///< mu [-]
  };
  struct History {
    Vec3f force;   ///< on i [N]
    Vec3f axis;    ///< direction of T [-]
    float branch;  ///< 0 loading, 1 unloading, 2 reloading
    float turn;    ///< T* [N]
    float back;    ///< T** [N]
    float cap;     ///< mu F of the step before [N]
    float stored;  ///< [J]
  };
  static constexpr unsigned kVectorWords = 0b111111;

  static Params Make(const Elastic& a, const Elastic& b, const ContactProperties& f,
                     const Settings&) {
    return {static_cast<float>(6 * EffectiveShearModulus(a, b) / EffectiveModulus(a, b)),
            static_cast<float>(f.friction)};
  }

  /// Moves the turning points with the normal force and finds the branch.
  /// t [N]: T along the axis; push = k_t0 ds along it [N]; d_cap = mu dF [N].
  static GROUSER_HD void Turn(float t, float push, float d_cap, History& h) {
    const float turn = h.turn + d_cap, back = h.back - d_cap;
    const bool loading = h.branch < 0.5f;
    const bool reloading = h.branch > 1.5f;
    const bool resumed = loading | (t >= turn) | (!reloading & (t <= -turn));
    // A real reversal, not the retreat of T that a falling F brings by itself.
    const bool reverses = resumed & (push < Min(d_cap, 0.0f)) & (t > 0.0f);
    const bool again = !resumed & reloading & (push < 0.0f);
    const bool returns = !resumed & !reloading & (push > 0.0f);
    h.turn = (reverses | again) ? Max(t + d_cap, t) : turn;
    h.back = returns ? t - d_cap : back;
    const float stays = reloading ? 2.0f : 1.0f;
    h.branch = (reverses | again) ? 1.0f : resumed ? 0.0f : returns ? 2.0f : stays;
  }

  static SpringBound Bounds(const Params& p, double stiffness, double) {
    return {p.ratio * stiffness, 0};
  }
  static GROUSER_HD TangentialTerms Evaluate(const Params& p, const ContactGeometry& g, Vec3f v_t,
                                             const NormalTerms& normal, History& h, float dt) {
    const float kt = p.ratio * normal.stiffness, kt_old = p.ratio * g.k_old;
    const float cap = p.friction * normal.grip, d_cap = cap - h.cap;
    const Vec3f held = TurnIntoPlane(h.force, g.n);
    const Vec3f ds = -dt * v_t;
    const float size = Sqrt(Dot(held, held)), move = Sqrt(Dot(ds, ds));
    // Along the force; from rest along the motion.
    const bool held_any = size > 0.0f;
    const Vec3f along = (1.0f / Max(held_any ? size : move, 1e-30f)) * Select(held_any, held, ds);
    const Vec3f kept_axis = TurnIntoPlane(h.axis, g.n);
    const bool fresh = h.branch < 0.5f;
    const Vec3f axis = Select(fresh, along, kept_axis);
    const float t = Dot(held, axis), s = Dot(ds, axis);
    Turn(t, kt * s, d_cap, h);
    // Loading resumed: along the force as it points now.
    const bool loading = h.branch < 0.5f;
    const bool unloading = !loading & (h.branch < 1.5f);
    const Vec3f e = Select(loading, along, axis);
    const float te = loading ? size : t, se = Dot(ds, e);
    const float gone =
        loading ? 2.0f * (te + d_cap) : (unloading ? h.turn - te : te - h.back) + d_cap;
    const float cube = 1.0f - gone / Max(2.0f * cap, 1e-30f);
    const bool pressed = d_cap > kt * Sqrt(se * se);
    const float theta = pressed ? 1.0f : Cbrt(Max(Min(cube, 1.0f), 0.0f));
    const float by_force = (1.0f - theta) * d_cap;
    const float te_new = te + kt * theta * se + (unloading ? -by_force : by_force);
    const float soften = kt_old > kt ? kt / Max(kt_old, 1e-30f) : 1.0f;
    const Vec3f across = soften * (held - te * e) + kt * (ds - se * e);
    const Vec3f trial = te_new * e + across;
    const float trial_size = Sqrt(Dot(trial, trial));
    const Vec3f capped = (trial_size > cap ? cap / Max(trial_size, 1e-30f) : 1.0f) * trial;
    // What the energy put in so far allows.
    const float half_flex = 0.5f / Max(kt, 1e-30f);
    const float have = Max(h.stored + 0.5f * Dot(held + capped, ds), 0.0f);
    const float needs = half_flex * Dot(capped, capped);
    const bool poor = needs * 0.9999f > have;
    const Vec3f force = (poor ? Sqrt(have / Max(needs, 1e-30f)) : 1.0f) * capped;
    const float sum = h.stored + 0.5f * Dot(held + force, ds);
    TangentialTerms out;
    out.force = force;
    const float turned = loading ? 0.0f : h.turn * h.turn;
    out.stored = Max(Min(sum, 1.26f * half_flex * Max(Dot(force, force), turned)), 0.0f);
    out.slip_work = sum - out.stored;
    out.damping_power = 0.0f;
    h.force = force;
    h.axis = e;
    h.cap = cap;
    h.stored = out.stored;
    return out;
  }
};

}  // namespace grouser::dem
