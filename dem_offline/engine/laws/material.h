#pragma once

#include "dem_offline/engine/laws/law.h"

namespace grouser::dem {

/// Throw std::invalid_argument for E <= 0 or nu outside (-1, 0.5]; restitution
/// outside (0, 1], friction, rolling friction or surface energy < 0.
void Check(const Elastic& m);
void Check(const ContactProperties& f);

/// E* of two bodies [Pa]: 1/E* = sum (1 - nu^2)/E; a rigid partner adds nothing.
double EffectiveModulus(const Elastic& a, const Elastic& b);
/// G* [Pa]: 1/G* = sum 2 (2 - nu)(1 + nu)/E (= sum (2 - nu)/G).
double EffectiveShearModulus(const Elastic& a, const Elastic& b);
/// D = -2 sqrt(5/6) beta(e), beta = ln e/sqrt(ln^2 e + pi^2): damping number of
/// Hertz with restitution e.
double RestitutionDamping(double restitution);
/// zeta = -beta(e): share of critical damping of a linear spring with restitution e.
double LinearDampingRatio(double restitution);

/// c of a dashpot D sqrt(k m) [N s/m].
inline double DampingOf(double number, double stiffness, double mass) {
  return number * __builtin_sqrt(stiffness * mass);
}

inline constexpr double kRigid = __builtin_huge_val();  ///< Young's modulus of a rigid body

}  // namespace grouser::dem
