#include "surrogate/models/quadrature.h"

#include <cmath>
#include <numbers>

namespace grouser::surrogate {

template <int N>
GaussRule<N> GaussLegendre() noexcept {
  GaussRule<N> rule;
  for (int i = 0; i < N; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (N + 0.5)), slope = 1;
    for (int k = 0; k < 10; ++k) {  // quadratic: 5 would do
      double p0 = 1, p1 = x;
      for (int j = 2; j <= N; ++j) {
        const double p2 = ((2 * j - 1) * x * p1 - (j - 1) * p0) / j;
        p0 = p1;
        p1 = p2;
      }
      slope = N * (x * p1 - p0) / (x * x - 1);
      x -= p1 / slope;
    }
    rule.node[i] = 0.5 * (1 - x);
    rule.weight[i] = 1 / ((1 - x * x) * slope * slope);
  }
  for (std::size_t i = N; i < rule.node.size(); ++i) {
    rule.node[i] = rule.node[N - 1];
    rule.weight[i] = 0;
  }
  return rule;
}

template <int N>
GaussRule<N> GradedGauss() noexcept {
  GaussRule<N> rule = GaussLegendre<N>();
  for (std::size_t i = 0; i < rule.node.size(); ++i) {
    const double u = rule.node[i];
    rule.node[i] = u * u;
    rule.weight[i] *= 2 * u;
  }
  return rule;
}

namespace {

constexpr int kPoints = 16, kPanels = 32;

// Gauss-Legendre in equal panels of u, x = u^3.
GaussRule<kPanels * kPoints> FineRule() noexcept {
  const GaussRule<kPoints> panel = GaussLegendre<kPoints>();
  GaussRule<kPanels * kPoints> rule;
  for (int i = 0; i < kPanels * kPoints; ++i) {
    const double u = (i / kPoints + panel.node[i % kPoints]) / kPanels;
    rule.node[i] = u * u * u;
    rule.weight[i] = panel.weight[i % kPoints] * 3 * u * u / kPanels;
  }
  return rule;
}

template <int N>
QuadratureRule Lasting(const GaussRule<N>& rule) {
  return {N, rule.node.data(), rule.weight.data()};
}

}  // namespace

const BekkerRules& RulesOfBekker() noexcept {
  static const GaussRule<kPoints> full = GaussLegendre<kPoints>();
  static const GaussRule<4> coarse = GradedGauss<4>();
  static const GaussRule<8> better = GradedGauss<8>();
  static const GaussRule<kPanels* kPoints> fine = FineRule();
  static const BekkerRules rules{Lasting(full), {Lasting(coarse), Lasting(better)}, Lasting(fine)};
  return rules;
}

}  // namespace grouser::surrogate
