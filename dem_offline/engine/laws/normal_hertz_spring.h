#pragma once

#include "dem_offline/engine/laws/material.h"

namespace grouser::dem {

/// Hertz spring beside a dashpot, on which the damped Hertz laws stand.
///   F_n = 4/3 E* a delta + c d(delta)/dt,   a = sqrt(R* delta)
/// A law derives from HertzSpring<itself>, has Params with the member e_star (E*
/// [Pa]), and says what its c [N s/m] is:
///   static GROUSER_HD float Dashpot(const Params&, const ContactGeometry&, float stiffness)
/// stiffness: the secant 4/3 E* a [N/m]. The sum is not cut off where it is
/// attractive, since that would change the restitution. Valid for overlap << R
/// (state: under 0.1 R).
/// Source: Hertz 1882.
/// Interaction range: overlap > 0. History words: none. Stiffness bound: the
/// tangent 2 E* a. Energy: stored, normal damping.
template <class Law>
struct HertzSpring {
  static constexpr unsigned kProvides = kHertzRadius | kHertzElastic, kNeeds = 0;
  struct History {};

  static constexpr double kSecantShare = 2.0 / 3;
  template <class Params>
  static double Stiffness(const Params& p, double overlap, double r_eff, double /*m_eff*/) {
    return 2.0 * p.e_star * __builtin_sqrt(r_eff * overlap);
  }

  template <class Params>
  static GROUSER_HD NormalTerms Evaluate(const Params& p, const ContactGeometry& g,
                                         float overlap_rate, History&, float) {
    const float a = Sqrt(g.r_eff * g.overlap);
    const float stiffness = 4.0f / 3.0f * p.e_star * a;
    const float c = Law::Dashpot(p, g, stiffness);
    NormalTerms out;
    out.force = stiffness * g.overlap + c * overlap_rate;
    out.grip = Max(out.force, 0.0f);
    out.stiffness = stiffness;
    out.radius = a;
    out.damping_power = c * overlap_rate * overlap_rate;
    out.stored = 0.4f * stiffness * g.overlap * g.overlap;
    out.plastic = 0.0f;
    return out;
  }
};

}  // namespace grouser::dem
