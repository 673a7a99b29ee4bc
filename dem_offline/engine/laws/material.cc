#include "dem_offline/engine/laws/material.h"

#include <cmath>

namespace grouser::dem {
namespace {

double Beta(double restitution) {
  const double ln_e = std::log(restitution);
  return ln_e / std::sqrt(ln_e * ln_e + M_PI * M_PI);
}

}  // namespace

void Check(const Elastic& m) {
  Require(m.youngs_modulus_pa > 0, "youngs_modulus_pa", m.youngs_modulus_pa, "> 0");
  Require(m.poisson_ratio > -1 && m.poisson_ratio <= 0.5, "poisson_ratio", m.poisson_ratio,
          "in (-1, 0.5]");
}

void Check(const ContactProperties& f) {
  Require(f.restitution > 0 && f.restitution <= 1, "restitution", f.restitution, "in (0, 1]");
  Require(f.friction >= 0, "friction", f.friction, ">= 0");
  Require(f.rolling_friction >= 0, "rolling_friction", f.rolling_friction, ">= 0");
  Require(f.rolling_damping >= 0, "rolling_damping", f.rolling_damping, ">= 0");
  Require(f.surface_energy_j_per_m2 >= 0, "surface_energy_j_per_m2", f.surface_energy_j_per_m2,
          ">= 0");
}

double EffectiveModulus(const Elastic& a, const Elastic& b) {
  const auto compliance = [](const Elastic& m) {
    return (1 - m.poisson_ratio * m.poisson_ratio) / m.youngs_modulus_pa;
  };
  return 1 / (compliance(a) + compliance(b));
}

double EffectiveShearModulus(const Elastic& a, const Elastic& b) {
  const auto compliance = [](const Elastic& m) {
    return 2 * (2 - m.poisson_ratio) * (1 + m.poisson_ratio) / m.youngs_modulus_pa;
  };
  return 1 / (compliance(a) + compliance(b));
}

double RestitutionDamping(double restitution) {
  return -2 * std::sqrt(5.0 / 6.0) * Beta(restitution);
}
double LinearDampingRatio(double restitution) { return -Beta(restitution); }

}  // namespace grouser::dem
