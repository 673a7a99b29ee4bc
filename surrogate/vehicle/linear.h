#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "surrogate/vehicle/mechanics.h"

namespace grouser::vehicle {

/// x with a x = b for the first n rows, by elimination with partial pivots (a dozen unknowns: a
/// library's call costs more). kSize: n where the compiler shall know it, else 0. False: singular
/// to 1e-10 of its largest entry.
template <std::size_t kSize>
bool Eliminate(const std::array<Column, kMostUnknowns>& matrix, const Column& right,
               std::size_t size, Column* x) noexcept {
  const std::size_t n = kSize > 0 ? kSize : size;
  constexpr std::size_t kMost = kSize > 0 ? kSize : kMostUnknowns;
  double a[kMost][kMost], b[kMost];
  double largest = 0;
  for (std::size_t i = 0; i < n; ++i) {
    b[i] = right[i];
    for (std::size_t k = 0; k < n; ++k) {
      a[i][k] = matrix[i][k];
      const double entry = std::fabs(a[i][k]);
      if (entry > largest) largest = entry;
    }
  }
  for (std::size_t c = 0; c < n; ++c) {
    std::size_t pivot = c;
    for (std::size_t i = c + 1; i < n; ++i) {
      if (std::fabs(a[i][c]) > std::fabs(a[pivot][c])) pivot = i;
    }
    if (!(std::fabs(a[pivot][c]) > 1e-10 * largest)) return false;
    if (pivot != c) {
      std::swap(a[c], a[pivot]);
      std::swap(b[c], b[pivot]);
    }
    const double inverse = 1 / a[c][c];
    for (std::size_t i = c + 1; i < n; ++i) {
      const double f = a[i][c] * inverse;
      for (std::size_t k = c + 1; k < n; ++k) a[i][k] -= f * a[c][k];
      b[i] -= f * b[c];
    }
  }
  for (std::size_t c = n; c-- > 0;) {
    double sum = b[c];
    for (std::size_t k = c + 1; k < n; ++k) sum -= a[c][k] * (*x)[k];
    (*x)[c] = sum / a[c][c];
  }
  return true;
}

inline bool SolveLinear(const std::array<Column, kMostUnknowns>& a, const Column& b, std::size_t n,
                        Column* x) noexcept {
  switch (n) {  // skid steering, and steering with independent wheels; a cart with a differential
    case 4:
      return Eliminate<4>(a, b, n, x);
    case 8:
      return Eliminate<8>(a, b, n, x);
    default:
      return Eliminate<0>(a, b, n, x);
  }
}

/// x of least |a x - b|^2 + damping |D x|^2, D^2 = diagonal of a^T a, or its mean where an unknown
/// changes little (Levenberg and Marquardt).
inline void SolveDamped(const std::array<Column, kMostUnknowns>& a, const Column& b, std::size_t n,
                        double damping, Column* x) noexcept {
  std::array<Column, kMostUnknowns> normal;
  Column right;
  double mean = 0;
  for (std::size_t i = 0; i < n; ++i) {
    right[i] = 0;
    for (std::size_t r = 0; r < n; ++r) right[i] += a[r][i] * b[r];
    for (std::size_t k = 0; k < n; ++k) {
      normal[i][k] = 0;
      for (std::size_t r = 0; r < n; ++r) normal[i][k] += a[r][i] * a[r][k];
    }
    mean += normal[i][i] / static_cast<double>(n);
  }
  for (std::size_t i = 0; i < n; ++i) {
    normal[i][i] += damping * std::fmax(normal[i][i], 1e-3 * mean) + 1e-30;
  }
  if (!SolveLinear(normal, right, n, x)) x->fill(0);
}

}  // namespace grouser::vehicle
