#pragma once

#include "dem_offline/engine/laws/material.h"

namespace grouser::dem {

/// Mindlin no-slip spring on the tangential displacement.
///   xi <- xi - v_t dt,  F = k_t xi - D sqrt(k_t m*) v_t,  k_t = 8 G* a
///   |k_t xi| > mu F_n: xi shortened to mu F_n/k_t (sliding: no damping)
/// xi [m]: tangential displacement history. It is the form in which most codes
/// and the oblique impact of Chung & Ooi (Granular Matter 13 (2011) 643, test
/// 4) were published. A sheared contact that is pressed harder gains stored
/// energy from nowhere, (k_t - k_t_old) xi^2/2: prefer `mindlin`; here that
/// energy stands in slip with its sign, so that the sum still closes.
/// History words: 3. Energy: stored k_t xi^2/2, tangential damping, slip.
struct MindlinDisplacement {
  static constexpr const char* kName = "mindlin_displacement";
  static constexpr unsigned kNeeds = kHertzRadius;
  struct Settings {};
  template <class S, class V>
  static void Fields(S&, V&&) {}
  struct Params {
    float ratio;     ///< k_t over the secant normal stiffness 4/3 E* a: 6 G*/E* [-]
    float damping;   ///< D [-], as in HertzRestitution
    float friction;  ///< mu [-]
  };
  struct History {
    Vec3f stretch;  ///< xi [m], in the direction of the force on i
  };
  static constexpr unsigned kVectorWords = 0b111;

  static Params Make(const Elastic& a, const Elastic& b, const ContactProperties& f,
                     const Settings&) {
    return {static_cast<float>(6 * EffectiveShearModulus(a, b) / EffectiveModulus(a, b)),
            static_cast<float>(RestitutionDamping(f.restitution)), static_cast<float>(f.friction)};
  }

  static SpringBound Bounds(const Params& p, double stiffness, double m_eff) {
    return {p.ratio * stiffness, DampingOf(p.damping * __builtin_sqrt(p.ratio), stiffness, m_eff)};
  }
  static GROUSER_HD TangentialTerms Evaluate(const Params& p, const ContactGeometry& g, Vec3f v_t,
                                             const NormalTerms& normal, History& h, float dt) {
    const float kt = p.ratio * normal.stiffness;
    const float cap = p.friction * normal.grip;
    const Vec3f kept = TurnIntoPlane(h.stretch, g.n);
    const Vec3f trial = kept - dt * v_t;
    const float size = kt * Sqrt(Dot(trial, trial));
    const bool slides = size > cap;
    const float scale = slides ? cap / Max(size, 1e-30f) : 1.0f;
    h.stretch = scale * trial;
    const Vec3f elastic = kt * h.stretch;
    const float c = slides ? 0.0f : p.damping * Sqrt(kt * g.m_eff);
    const Vec3f total = elastic - c * v_t;
    const float total_size = Sqrt(Dot(total, total));
    const float back = total_size > cap ? cap / Max(total_size, 1e-30f) : 1.0f;
    TangentialTerms out;
    out.force = back * total;
    out.stored = 0.5f * kt * Dot(h.stretch, h.stretch);
    const float kt_old = p.ratio * g.k_old;
    const float slid = (1.0f - scale) * Sqrt(Dot(trial, trial));
    out.slip_work = cap * slid - 0.5f * (kt - kt_old) * Dot(kept, kept);
    out.damping_power = Dot(elastic - out.force, v_t);
    return out;
  }
};

}  // namespace grouser::dem
