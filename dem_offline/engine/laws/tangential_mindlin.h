#pragma once

#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/laws/tangential_spring.h"

namespace grouser::dem {

/// Mindlin no-slip spring with Coulomb's cap, incremental in force, rescaled
/// when the contact unloads (without the rescaling it makes energy).
///   F <- F min(1, k_t/k_t_old) - k_t v_t dt,   k_t = 8 G* a
///   |F| > mu F_n: F <- mu F_n F/|F| (sliding: no damping)
///   else total = F - D sqrt(k_t m*) v_t, capped by mu F_n as well
/// v_t [m/s]: tangential velocity of i relative to its partner at the contact;
/// k_t_old: a step ago, from the normal stiffness kept, 6 G*/E* k_n.
/// Source: Mindlin 1949; Walton & Braun 1986; rescaling: Thornton, Cummins &
/// Cleary, Powder Technol. 210 (2011) 189.
/// History words: 3 (elastic force). Energy: stored F^2/(2 k_t), tangential
/// damping, slip (loss of a stiffening spring included).
struct MindlinRescaled {
  static constexpr const char* kName = "mindlin";
  static constexpr unsigned kNeeds = kHertzRadius;
  struct Settings {};
  template <class S, class V>
  static void Fields(S&, V&&) {}
  struct Params {
    float ratio;     ///< k_t over the secant normal stiffness 4/3 E* a: 6 G*/E* [-]
    float damping;   ///< D sqrt(ratio) [-], D as in HertzRestitution
    float friction;  ///< mu [-]
  };
  struct History {
    Vec3f elastic;  ///< elastic force on i [N]
  };
  static constexpr unsigned kVectorWords = 0b111;

  static Params Make(const Elastic& a, const Elastic& b, const ContactProperties& f,
                     const Settings&) {
    const double ratio = 6 * EffectiveShearModulus(a, b) / EffectiveModulus(a, b);
    return {static_cast<float>(ratio),
            static_cast<float>(RestitutionDamping(f.restitution) * __builtin_sqrt(ratio)),
            static_cast<float>(f.friction)};
  }

  static SpringBound Bounds(const Params& p, double stiffness, double m_eff) {
    return {p.ratio * stiffness, DampingOf(p.damping, stiffness, m_eff)};
  }
  static GROUSER_HD TangentialTerms Evaluate(const Params& p, const ContactGeometry& g, Vec3f v_t,
                                             const NormalTerms& normal, History& h, float dt) {
    const float kt = p.ratio * normal.stiffness;
    return StepSpring(kt, p.ratio * g.k_old, p.friction * normal.grip,
                      p.damping * Sqrt(normal.stiffness * g.m_eff), g, v_t, dt, h.elastic);
  }
};

}  // namespace grouser::dem
