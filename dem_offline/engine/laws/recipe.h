#pragma once

#include "dem_offline/engine/laws/normal_hertz.h"
#include "dem_offline/engine/laws/rolling_epsd.h"
#include "dem_offline/engine/laws/tangential_mindlin.h"

namespace grouser::dem {

/// Words of one contact's history, in this order.
enum HistoryWord : int {
  kTangentX, kTangentY, kTangentZ, kOldRadius, kRollX, kRollY, kRollZ, kHistoryWords
};

struct ContactHistory {
  Vec3f tangent;     ///< elastic tangential force on i [N]
  float old_radius;  ///< contact radius of the step before [m]; 0: new contact
  Vec3f roll;        ///< elastic rolling moment on i [N m]
};

/// A contact as grain i sees it. Swapping i and j changes the sign of n,
/// v_rel and w_rel and nothing else, so that both sides compute the same.
struct ContactGeometry {
  Vec3f n;             ///< unit, from the partner to i
  float overlap;       ///< [m], > 0
  Vec3f v_rel;         ///< of i relative to the partner, at the contact [m/s]
  Vec3f w_rel;         ///< angular velocity of i relative to the partner [rad/s]
  float r_eff;         ///< R_i R_j/(R_i + R_j), or R_i at a wall [m]
  float m_eff;         ///< m_i m_j/(m_i + m_j), or m_i at a wall [kg]
  float roll_inertia;  ///< [kg m^2]
};

struct ContactResult {
  Vec3f force;   ///< on i, at the contact [N]
  Vec3f moment;  ///< rolling moment on i [N m]
  ContactHistory history;
  float normal_force;
  float stored;           ///< elastic energy [J]
  float normal_damping;   ///< dissipated in this step [J]
  float tangent_damping;
  float slip;
  float rolling;
};

/// One legal combination of laws, evaluated as one function.
template <class Normal, class Tangential, class Rolling>
struct Recipe {
  struct Params {
    typename Normal::Params normal;
    typename Tangential::Params tangential;
    typename Rolling::Params rolling;
  };

  static GROUSER_HD ContactResult Evaluate(const Params& p, const ContactGeometry& g,
                                           const ContactHistory& h, float dt) {
    const float v_n = Dot(g.v_rel, g.n);
    const NormalTerms normal = Normal::Evaluate(p.normal, g.overlap, -v_n, g.r_eff, g.m_eff);
    const Vec3f v_t = g.v_rel - v_n * g.n;
    const TangentialTerms tangent = Tangential::Evaluate(p.tangential, h.tangent, h.old_radius,
                                                         g.n, v_t, normal, g.m_eff, dt);
    const Vec3f w_t = g.w_rel - Dot(g.w_rel, g.n) * g.n;
    const RollingTerms roll = Rolling::Evaluate(p.rolling, h.roll, g.n, w_t, normal,
                                                h.old_radius, g.r_eff, g.roll_inertia, dt);
    ContactResult out;
    out.force = normal.force * g.n + tangent.force;
    out.moment = roll.moment;
    out.history = {tangent.elastic, normal.radius, roll.elastic};
    out.normal_force = normal.force;
    out.stored = normal.stored + tangent.stored + roll.stored;
    out.normal_damping = normal.damping_power * dt;
    out.tangent_damping = tangent.damping_power * dt;
    out.slip = tangent.slip_work;
    out.rolling = roll.loss;
    return out;
  }
};

/// The default recipe.
using HertzMindlinEpsd = Recipe<HertzRestitution, MindlinCoulomb, RollingEpsd>;

}  // namespace grouser::dem
