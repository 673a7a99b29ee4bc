#pragma once

#include "dem_offline/engine/laws/normal_hertz.h"

namespace grouser::dem {

/// What a tangential law returns.
struct TangentialTerms {
  Vec3f force;          ///< on grain i [N]
  Vec3f elastic;        ///< new history: elastic part [N]
  float damping_power;  ///< [W]
  float slip_work;      ///< dissipated by sliding in this step [J]
  float stored;         ///< elastic energy [J]
};

/// Mindlin no-slip spring with Coulomb's cap, incremental in force, rescaled
/// when the contact unloads (without the rescaling it makes energy).
///   F <- F min(1, a/a_old) - k_t v_t dt,   k_t = 8 G* a
///   |F| > mu F_n: F <- mu F_n F/|F| (sliding: no damping)
///   else total = F - D sqrt(k_t m*) v_t, capped by mu F_n as well
/// v_t [m/s]: tangential velocity of i relative to its partner at the contact.
/// Source: Mindlin 1949; Walton & Braun 1986; rescaling: Thornton, Cummins &
/// Cleary, Powder Technol. 210 (2011) 189.
/// History words: 3 (elastic force) + 1 (a_old). Energy: stored F^2/(2 k_t),
/// tangential damping, slip (loss of a stiffening spring included).
struct MindlinCoulomb {
  struct Params {
    float g_star;    ///< effective shear modulus G* [Pa]
    float damping;   ///< D [-], as in HertzRestitution
    float friction;  ///< mu [-]
  };

  static GROUSER_HD TangentialTerms Evaluate(const Params& p, Vec3f history, float a_old, Vec3f n,
                                             Vec3f v_t, const NormalTerms& normal, float m_eff,
                                             float dt) {
    const float a = normal.radius;
    const float kt = 8.0f * p.g_star * a;
    const float cap = p.friction * Max(normal.force, 0.0f);
    const float unload = a < a_old ? a / Max(a_old, 1e-30f) : 1.0f;
    const Vec3f kept = unload * TurnIntoPlane(history, n);
    const Vec3f trial = kept - (kt * dt) * v_t;
    const float size = Sqrt(Dot(trial, trial));
    const bool slides = size > cap;
    const float scale = slides ? cap / Max(size, 1e-30f) : 1.0f;
    TangentialTerms out;
    out.elastic = scale * trial;
    const float c = slides ? 0.0f : p.damping * Sqrt(kt * m_eff);
    const Vec3f total = out.elastic - c * v_t;
    const float total_size = Sqrt(Dot(total, total));
    const float back = total_size > cap ? cap / Max(total_size, 1e-30f) : 1.0f;
    out.force = back * total;
    // Bookkeeping. Work put in by v_t dt against the mean elastic force goes
    // to storage, to sliding, and to the springs' change of stiffness.
    out.stored = 0.5f * Dot(out.elastic, out.elastic) / Max(kt, 1e-30f);
    const float kt_old = 8.0f * p.g_star * Max(a_old, 1e-30f);
    const float held = Dot(history, history), kept_size = Dot(kept, kept);
    const float stiffening =
        a_old > 0.0f ? 0.5f * (held / kt_old - kept_size / Max(kt, 1e-30f)) : 0.0f;
    const float plastic = (1.0f - scale) * size / Max(kt, 1e-30f);
    out.slip_work = cap * (slides ? plastic : 0.0f) + Max(stiffening, 0.0f);
    out.damping_power = Dot(out.elastic - out.force, v_t);
    return out;
  }
};

}  // namespace grouser::dem
