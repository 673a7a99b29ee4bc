#pragma once

#include "dem_offline/engine/laws/vec3.h"

namespace grouser::dem {

/// What a normal law tells the other laws of the contact.
struct NormalTerms {
  float force;          ///< repulsive [N] (may be slightly negative while parting)
  float stiffness;      ///< secant stiffness force/overlap of the elastic part [N/m]
  float radius;         ///< contact radius a [m]
  float damping_power;  ///< dissipated [W], >= 0
  float stored;         ///< elastic energy [J]
};

/// Hertz contact with restitution damping.
///   F_n = 4/3 E* sqrt(R*) delta^(3/2) + D sqrt(S_n m*) d(delta)/dt
///   S_n = 2 E* a,  a = sqrt(R* delta),  D = -2 sqrt(5/6) beta,
///   beta = ln e / sqrt(ln^2 e + pi^2)
/// so that the coefficient of restitution is e at every impact speed. The
/// damping force is not cut off where it makes the sum attractive, since the
/// cut-off would change e. Valid for overlap << R (state: under 0.1 R).
/// Source: Hertz 1882; Tsuji et al., Powder Technol. 71 (1992) 239; the form
/// of beta as in Antypov & Elliott, EPL 94 (2011) 50004.
/// Interaction range: overlap > 0. History words: none. Stiffness bound for
/// the time step: dF/d(delta) = 2 E* a. Energy: stored, normal damping.
struct HertzRestitution {
  struct Params {
    float e_star;   ///< effective modulus E* [Pa]
    float damping;  ///< D [-]
  };

  static GROUSER_HD NormalTerms Evaluate(const Params& p, float overlap, float overlap_rate,
                                         float r_eff, float m_eff) {
    const float a = Sqrt(r_eff * overlap);
    const float stiffness = 4.0f / 3.0f * p.e_star * a;
    const float c = p.damping * Sqrt(2.0f * p.e_star * a * m_eff);
    NormalTerms out;
    out.force = stiffness * overlap + c * overlap_rate;
    out.stiffness = stiffness;
    out.radius = a;
    out.damping_power = c * overlap_rate * overlap_rate;
    out.stored = 0.4f * stiffness * overlap * overlap;
    return out;
  }
};

}  // namespace grouser::dem
