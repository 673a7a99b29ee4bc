#pragma once

#include <stdexcept>
#include <string>

#include "dem_offline/engine/core/vec3.h"

// What every contact law sees and says. A law is a struct without state:
//   static constexpr const char* kName       name in files and messages
//   struct Settings {...}                    what only this law needs (double, SI, defaults)
//   template <class S, class V> static void Fields(S& s, V&& v)
//                                            v("name_unit", s.name_unit) for each setting
//   struct Params {...}                      what Evaluate needs (float), from
//   static Params Make(const Elastic& a, const Elastic& b, const ContactProperties& f,
//                      const Settings& s)
//   struct History {...}                     floats and Vec3f only; zero: a new contact
//   static constexpr unsigned kVectorWords   (unless History is empty) bit w: word w is of a
//                                            Vec3f and changes its sign where i and j swap; the
//                                            same for a word w that another law of the slot has
//   static constexpr bool kOwnSides          (rolling laws) true: the moments of the two sides
//                                            are no mirror images: each is evaluated by itself
//   static constexpr unsigned kProvides      (normal laws) bits of Trait
//   static constexpr unsigned kNeeds         bits of Trait that the normal law must provide
//   static GROUSER_HD ... Evaluate(...)      see the slot
// and, for the time step, the stiffest spring and the strongest dashpot that it
// can be (see the slot; 0: the law has none).
// Evaluate must not branch on anything that differs between the two sides of a
// contact except through the signs of n, v_rel, w_rel and vector history (own
// spin laws excepted, which say so), uses only + - x / sqrt and the functions
// of vec3.h and math.h, and stays finite for every overlap > 0.

namespace grouser::dem {

/// Isotropic elastic solid. Infinite modulus: rigid.
struct Elastic {
  double youngs_modulus_pa = 0;
  double poisson_ratio = 0;
};

/// Numbers of a pair of surfaces that several laws share.
struct ContactProperties {
  double restitution = 0.5;            ///< normal, (0, 1]
  double friction = 0.5;               ///< Coulomb mu, >= 0
  double rolling_friction = 0.0;       ///< mu_r, >= 0
  double rolling_damping = 0.3;        ///< eta of EPSD; Ai et al. 2011 use 0.3
  double surface_energy_j_per_m2 = 0;  ///< work of adhesion gamma (both surfaces together)
};

/// What a normal law can promise to the laws beside it.
enum Trait : unsigned {
  kHertzRadius = 1u,   ///< radius a is the true contact radius, stiffness = 4/3 E* a
                       ///< (Hertz: a = sqrt(R* overlap))
  kHertzElastic = 2u,  ///< elastic part is exactly Hertz, without normal history
};

/// A contact as grain i sees it. Swapping i and j changes the sign of n,
/// v_rel and w_rel, exchanges own and other, and nothing else.
struct ContactGeometry {
  Vec3f n;             ///< unit, from the partner to i
  float overlap;       ///< [m]; negative only where a cohesion law has range
  Vec3f v_rel;         ///< of i relative to the partner, at the contact [m/s]
  Vec3f w_rel;         ///< angular velocity of i relative to the partner [rad/s]
  Vec3f w_own;         ///< angular velocity of i [rad/s]
  float r_own;         ///< radius of i [m]
  float r_other;       ///< of the partner [m]; at a body: r_own
  float r_eff;         ///< R_i R_j/(R_i + R_j), or R_i at a body [m]
  float m_own;         ///< mass of i (of its clump) [kg]
  float m_eff;         ///< m_i m_j/(m_i + m_j), or m_i at a body [kg]
  float roll_inertia;  ///< reduced 7/5 m R^2 [kg m^2]
  float k_old;         ///< NormalTerms::stiffness of the step before; 0: new contact
};

/// What a normal law (then the cohesion law) tells the other laws.
struct NormalTerms {
  float force;          ///< repulsive [N] (may be negative while parting)
  float grip;           ///< compression that friction feels [N], >= 0
  float stiffness;      ///< secant stiffness of the elastic part, force/overlap [N/m]
  float radius;         ///< contact radius a [m]
  float damping_power;  ///< dissipated [W], >= 0
  float stored;         ///< recoverable energy [J]
  float plastic;        ///< dissipated in this step by plastic work or hysteresis [J]
};
/// Most that a spring and dashpot put against motion [N/m] and [N s/m], or
/// against rotation [N m/rad] and [N m s/rad].
struct SpringBound {
  double stiffness = 0, damping = 0;
};

// Normal laws:  Evaluate(const Params&, const ContactGeometry&, float overlap_rate,
//                        History&, float dt) -> NormalTerms
//               static double Stiffness(const Params&, double overlap, double r_eff, double m_eff)
//                                   largest dF/d(overlap) up to this overlap [N/m]
//               static double Damping(const Params&, double overlap, double r_eff, double m_eff)
//                                   largest dF/d(overlap rate) up to this overlap [N s/m]
//               static constexpr double kSecantShare    of that stiffness: NormalTerms::stiffness

/// What a cohesion law returns; it also edits the NormalTerms.
struct CohesionTerms {
  bool active;  ///< is there a contact (or neck, or bridge) at all?
  float loss;   ///< dissipated in this step by making or breaking it [J]
};
// Cohesion laws: Evaluate(const Params&, const ContactGeometry&, NormalTerms&,
//                         History&, float dt) -> CohesionTerms
//                static constexpr bool kHasRange       acts at a negative overlap?
//                static double Range(const Params&, double smallest_radius_m,
//                                    double largest_radius_m)   furthest gap [m]
//                static double Stiffness(const Params&, double overlap, double r_eff)
//                                    at most added to the normal law's [N/m]

/// What a tangential law returns.
struct TangentialTerms {
  Vec3f force;          ///< on grain i [N]
  float damping_power;  ///< [W]
  float slip_work;      ///< dissipated by sliding in this step [J]
  float stored;         ///< elastic energy [J]
};
// Tangential laws: Evaluate(const Params&, const ContactGeometry&, Vec3f v_t,
//                           const NormalTerms&, History&, float dt) -> TangentialTerms
//   v_t: tangential part of v_rel [m/s]
//                   static SpringBound Bounds(const Params&, double stiffness, double m_eff)
//   stiffness: the largest NormalTerms::stiffness [N/m]

/// What a rolling law returns.
struct RollingTerms {
  Vec3f moment;  ///< on grain i [N m]
  float loss;    ///< dissipated in this step [J]
  float stored;  ///< [J]
};
// Rolling laws: Evaluate(const Params&, const ContactGeometry&, Vec3f w_t,
//                        const NormalTerms&, History&, float dt) -> RollingTerms
//   w_t: w_rel without its component along n [rad/s]
//                static SpringBound Bounds(const Params&, double stiffness, double r_eff,
//                                          double roll_inertia)
//                static constexpr double kStepShare   of the step that all springs and dashpots
//                                   bear: where half of it gives the same answers

/// A torque of constant size has no stiffness, and its damping torque/|w| has no
/// bound near rest, so no step is short enough for it. It is therefore capped at
/// the torque that takes this share of the spin in a step: those of six contacts
/// of a grain together then stop its spin and do not turn it round.
inline constexpr float kSpinShare = 1.0f / 6.0f;

/// Throws std::invalid_argument "field: got, expected ...".
inline void Require(bool ok, const char* field, double got, const char* expected) {
  if (!ok) {
    throw std::invalid_argument(std::string(field) + ": " + std::to_string(got) + ", expected " +
                                expected);
  }
}

/// Throws std::invalid_argument naming both where two settings that say the same
/// thing twice are both given.
inline void RequireOne(bool a_given, const char* a, bool b_given, const char* b) {
  if (a_given && b_given) {
    throw std::invalid_argument(std::string(a) + " and " + b + ": got both, expected one of them");
  }
}

}  // namespace grouser::dem
