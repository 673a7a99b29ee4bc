#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include <cstdint>

/// Functions of a real number that is a double or a pack of doubles (a GCC vector
/// type, one state to a lane). Straight-line code of + - x / sqrt and bit
/// operations, so that a double, a lane of any pack and any instruction set give
/// the same bits. Arguments outside the stated ranges give finite nonsense.
///
/// What is emitted here depends on the pack's type, which only one instruction set
/// uses: the linker cannot take a wide set's code for all. Nothing of the standard
/// library belongs here, or in what includes this and is compiled once a set.
namespace grouser::surrogate {

#define GROUSER_INLINE [[gnu::always_inline]] inline

template <class V, int N>
struct Dual;  // dual.h

namespace number {
template <class T>
struct Parts {
  using Base = T;
  static constexpr bool kDual = false;
};
template <class V, int N>
struct Parts<Dual<V, N>> {
  using Base = V;
  static constexpr bool kDual = true;
};
template <class V>
struct Traits {
  using Mask = decltype(V{} < V{});
  typedef unsigned long long Bits __attribute__((vector_size(sizeof(V))));
};
template <>
struct Traits<double> {
  using Mask = bool;
  using Bits = std::uint64_t;
};
template <class V>
GROUSER_INLINE typename Traits<V>::Bits ToBits(V x) {
  return __builtin_bit_cast(typename Traits<V>::Bits, x);
}
}  // namespace number

/// double or pack below a number.
template <class T>
using Base = typename number::Parts<T>::Base;
/// A number without derivatives: a double or a pack.
template <class S>
concept Plain = !number::Parts<S>::kDual;

/// The result of comparing two of V: one truth a lane.
template <class V>
using Mask = typename number::Traits<V>::Mask;

template <class V>
GROUSER_INLINE V Set(double x) {
  return V{} + x;
}

template <Plain V>
GROUSER_INLINE V Select(Mask<V> mask, V a, V b) {
  return mask ? a : b;
}

/// Whether any lane is true.
template <class V>
GROUSER_INLINE bool Any(Mask<V> mask) {
  if constexpr (sizeof(V) == sizeof(double)) {
    return mask;
  } else {
    long long any = 0;
    for (unsigned i = 0; i < sizeof(V) / sizeof(double); ++i) any |= mask[i];
    return any != 0;
  }
}

/// The lanes of a pack, from and to consecutive numbers.
template <class V>
GROUSER_INLINE V Load(const double* from) {
  V v;
  __builtin_memcpy(&v, from, sizeof(v));
  return v;
}
template <class V>
GROUSER_INLINE void Store(double* to, V v) {
  __builtin_memcpy(to, &v, sizeof(v));
}

template <class V>
GROUSER_INLINE V Max(V a, V b) {
  return a > b ? a : b;
}
template <class V>
GROUSER_INLINE V Min(V a, V b) {
  return a < b ? a : b;
}
template <class V>
GROUSER_INLINE V Abs(V x) {
  return x < 0 ? -x : x;
}

template <class V>
GROUSER_INLINE V Sqrt(V x) {
  if constexpr (sizeof(V) == sizeof(double)) {
    return __builtin_sqrt(x);
#if defined(__AVX512F__)  // the unmasked form warns of its own undefined lanes
  } else if constexpr (sizeof(V) == 64) {
    return (V)_mm512_maskz_sqrt_pd(0xff, (__m512d)x);
#endif
#if defined(__AVX__)
  } else if constexpr (sizeof(V) == 32) {
    return (V)_mm256_sqrt_pd((__m256d)x);
#endif
  } else {
    static_assert(sizeof(V) == 16);
    return V{__builtin_sqrt(x[0]), __builtin_sqrt(x[1])};
  }
}

/// e^x = scale (1 + rest), scale a power of 2, |rest| < 0.42; |x| <= 700, clamped outside.
template <class V>
struct ExpTerms {
  V scale, rest;
};
template <class V>
GROUSER_INLINE ExpTerms<V> SplitExp(V x) {
  x = Min(Max(x, Set<V>(-700)), Set<V>(700));
  constexpr double kMagic = 6755399441055744.0;  // 1.5 * 2^52: rounds to integer
  const V shifted = x * 1.4426950408889634 + kMagic;
  const V k = shifted - kMagic;
  const V r = (x - k * 6.93147180369123816490e-01) - k * 1.90821492927058770002e-10;
  const V r2 = r * r;
  // Even and odd halves: two short chains instead of a long one.
  V even = r2 * (1.0 / 479001600) + 1.0 / 3628800;
  even = even * r2 + 1.0 / 40320;
  even = even * r2 + 1.0 / 720;
  even = even * r2 + 1.0 / 24;
  even = even * r2 + 0.5;
  V odd = r2 * (1.0 / 39916800) + 1.0 / 362880;
  odd = odd * r2 + 1.0 / 5040;
  odd = odd * r2 + 1.0 / 120;
  odd = odd * r2 + 1.0 / 6;
  odd = odd * r2 + 1.0;
  // The integer stands in the low bits of `shifted`: build 2^k from it.
  return {__builtin_bit_cast(V, (number::ToBits(shifted) + 1023) << 52), even * r2 + r * odd};
}
/// e^x; relative error below 1e-14, exact at 0.
template <class V>
GROUSER_INLINE V Exp(V x) {
  const ExpTerms<V> e = SplitExp(x);
  return (1.0 + e.rest) * e.scale;
}
/// 1 - e^-x, without cancellation near 0; relative error below 1e-14.
template <class V>
GROUSER_INLINE V Rise(V x) {
  const ExpTerms<V> e = SplitExp(V(-x));
  return (1.0 - e.scale) - e.scale * e.rest;
}

/// ln x for normal positive x; absolute error below 1e-14 (1 + |ln x|).
template <class V>
GROUSER_INLINE V Log(V x) {
  constexpr std::uint64_t kOffset = 0x3fe6a09e667f3bcd;  // sqrt(1/2)
  const auto bits = number::ToBits(x);
  const auto biased = (bits - kOffset + (std::uint64_t{1023} << 52)) >> 52;
  const V e = __builtin_bit_cast(V, biased | std::uint64_t{0x4330000000000000}) -
              (4503599627370496.0 + 1023.0);
  const V m = __builtin_bit_cast(V, bits - ((biased - 1023) << 52));
  const V f = (m - 1.0) / (m + 1.0);
  const V f2 = f * f;
  V p = f2 * (1.0 / 17) + 1.0 / 15;
  p = p * f2 + 1.0 / 13;
  p = p * f2 + 1.0 / 11;
  p = p * f2 + 1.0 / 9;
  p = p * f2 + 1.0 / 7;
  p = p * f2 + 1.0 / 5;
  p = p * f2 + 1.0 / 3;
  p = p * f2 + 1.0;
  return 2.0 * f * p + e * 0.69314718055994530942;
}

/// sin and cos of x, and sin^2(x/2); |x| <= 1.8, errors below 1e-13.
template <class T>
struct Angle {
  T sin, cos, half_sin2;
};
template <class V>
GROUSER_INLINE Angle<V> SinCos(V x) {
  const V h = 0.5 * x, y = h * h;
  V s = y * (-1.0 / 1307674368000.0) + 1.0 / 6227020800;
  s = s * y - 1.0 / 39916800;
  s = s * y + 1.0 / 362880;
  s = s * y - 1.0 / 5040;
  s = s * y + 1.0 / 120;
  s = s * y - 1.0 / 6;
  s = (s * y + 1.0) * h;
  V c = y * (-1.0 / 87178291200.0) + 1.0 / 479001600;
  c = c * y - 1.0 / 3628800;
  c = c * y + 1.0 / 40320;
  c = c * y - 1.0 / 720;
  c = c * y + 1.0 / 24;
  c = c * y - 0.5;
  c = c * y + 1.0;
  const V s2 = s * s;
  return {2.0 * s * c, 1.0 - 2.0 * s2, s2};
}

/// (1 - e^-x)/x, the mean of e^-s over s in [0, x], and its slope; x > 1e-9.
template <class V>
struct DecayTerms {
  V mean, slope;
};
template <class V>
GROUSER_INLINE DecayTerms<V> Decay(V x) {
  const V inverse = 1.0 / x, rest = Exp(-x), mean = (1.0 - rest) * inverse;
  return {mean, (rest - mean) * inverse};
}
template <class V>
GROUSER_INLINE V DecayMean(V x) {
  return Decay(x).mean;
}

}  // namespace grouser::surrogate
