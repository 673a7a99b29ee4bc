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
  return rule;
}

template <int N>
GaussRule<N> GradedGauss() noexcept {
  GaussRule<N> rule = GaussLegendre<N>();
  for (int i = 0; i < N; ++i) {
    const double u = rule.node[i];
    rule.node[i] = u * u;
    rule.weight[i] *= 2 * u;
  }
  return rule;
}

template GaussRule<16> GaussLegendre<16>() noexcept;
template GaussRule<4> GradedGauss<4>() noexcept;
template GaussRule<6> GradedGauss<6>() noexcept;
template GaussRule<8> GradedGauss<8>() noexcept;
template GaussRule<12> GradedGauss<12>() noexcept;
template GaussRule<16> GradedGauss<16>() noexcept;

}  // namespace grouser::surrogate
