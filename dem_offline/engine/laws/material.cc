#include "dem_offline/engine/laws/material.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace grouser::dem {
namespace {

void Require(bool ok, const char* field, double got, const char* expected) {
  if (!ok) {
    throw std::invalid_argument(std::string(field) + ": " + std::to_string(got) + ", expected " +
                                expected);
  }
}

void Check(const Elastic& m) {
  Require(m.youngs_modulus_pa > 0, "youngs_modulus_pa", m.youngs_modulus_pa, "> 0");
  Require(m.poisson_ratio > -1 && m.poisson_ratio <= 0.5, "poisson_ratio", m.poisson_ratio,
          "in (-1, 0.5]");
}

double NormalCompliance(const Elastic& m) {
  return (1 - m.poisson_ratio * m.poisson_ratio) / m.youngs_modulus_pa;
}

double ShearCompliance(const Elastic& m) {
  return 2 * (2 - m.poisson_ratio) * (1 + m.poisson_ratio) / m.youngs_modulus_pa;
}

HertzMindlinEpsd::Params FromCompliances(double normal, double shear, const Interface& f) {
  Require(f.restitution > 0 && f.restitution <= 1, "restitution", f.restitution, "in (0, 1]");
  Require(f.friction >= 0, "friction", f.friction, ">= 0");
  Require(f.rolling_friction >= 0, "rolling_friction", f.rolling_friction, ">= 0");
  const double ln_e = std::log(f.restitution);
  const double beta = ln_e / std::sqrt(ln_e * ln_e + M_PI * M_PI);
  const float damping = static_cast<float>(-2 * std::sqrt(5.0 / 6.0) * beta);
  HertzMindlinEpsd::Params p;
  p.normal = {static_cast<float>(1 / normal), damping};
  p.tangential = {static_cast<float>(1 / shear), damping, static_cast<float>(f.friction)};
  p.rolling = {static_cast<float>(f.rolling_friction), static_cast<float>(f.rolling_damping)};
  return p;
}

}  // namespace

HertzMindlinEpsd::Params MakeParams(const Elastic& a, const Elastic& b, const Interface& f) {
  Check(a);
  Check(b);
  return FromCompliances(NormalCompliance(a) + NormalCompliance(b),
                         ShearCompliance(a) + ShearCompliance(b), f);
}

HertzMindlinEpsd::Params MakeWallParams(const Elastic& a, const Interface& f) {
  Check(a);
  return FromCompliances(NormalCompliance(a), ShearCompliance(a), f);
}

}  // namespace grouser::dem
