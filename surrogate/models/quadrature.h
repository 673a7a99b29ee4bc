#pragma once

#include <array>

namespace grouser::surrogate {

/// Gauss-Legendre rule with N points on [0, 1], filled up to packs of 8: what follows the
/// points repeats the last one and has no weight.
template <int N>
struct GaussRule {
  alignas(64) std::array<double, (N + 7) / 8 * 8> node, weight;
};

/// The rule itself, by Newton's method on the Legendre polynomial.
template <int N>
GaussRule<N> GaussLegendre() noexcept;

/// The same after the substitution x = u^2, which takes the root of a power
/// x^n at 0 (stress at the edge of a contact) away: 6 points then do better
/// there than 16 without.
template <int N>
GaussRule<N> GradedGauss() noexcept;

/// A rule whose points live as long as the program.
struct QuadratureRule {
  int points;
  const double *node, *weight;
};

/// The rules that BekkerModel sums either branch of the contact with.
struct BekkerRules {
  QuadratureRule full;      ///< Gauss-Legendre, 16 points: what the law is defined with
  QuadratureRule first[2];  ///< graded, 4 and 8 points: of the balance's two Newton steps
  QuadratureRule fine;      ///< 32 panels of 16 crowding to the edge, exact to 1e-12
};
const BekkerRules& RulesOfBekker() noexcept;

}  // namespace grouser::surrogate
