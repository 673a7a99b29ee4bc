// Vectors of GROUSER_LANES doubles and what the lane code needs of arithmetic:
// + - x / sqrt and bit operations alone, so every set gives the same bits.
#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include <cstring>

#define GROUSER_LANE_INLINE [[gnu::always_inline]] static inline

namespace grouser::surrogate::GROUSER_ISA_NS {

typedef double V __attribute__((vector_size(GROUSER_LANES * 8)));
typedef unsigned long long Bits __attribute__((vector_size(GROUSER_LANES * 8)));
using Mask = decltype(V{} < V{});

GROUSER_LANE_INLINE V Set(double x) { return V{} + x; }

GROUSER_LANE_INLINE V Load(const double* from) {
  V v;
  std::memcpy(&v, from, sizeof(v));
  return v;
}

GROUSER_LANE_INLINE void Store(double* to, V v) { std::memcpy(to, &v, sizeof(v)); }

GROUSER_LANE_INLINE bool Any(Mask m) {
  long long any = 0;
  for (int i = 0; i < GROUSER_LANES; ++i) any |= m[i];
  return any != 0;
}

// Max and Min are a > b ? a : b and a < b ? a : b, in one instruction.
#if GROUSER_LANES == 8  // unmasked forms warn of their own undefined lanes
GROUSER_LANE_INLINE V Sqrt(V x) { return (V)_mm512_maskz_sqrt_pd(0xff, (__m512d)x); }
GROUSER_LANE_INLINE V Max(V a, V b) { return (V)_mm512_maskz_max_pd(0xff, (__m512d)a, (__m512d)b); }
GROUSER_LANE_INLINE V Min(V a, V b) { return (V)_mm512_maskz_min_pd(0xff, (__m512d)a, (__m512d)b); }
#elif GROUSER_LANES == 4
GROUSER_LANE_INLINE V Sqrt(V x) { return (V)_mm256_sqrt_pd((__m256d)x); }
GROUSER_LANE_INLINE V Max(V a, V b) { return (V)_mm256_max_pd((__m256d)a, (__m256d)b); }
GROUSER_LANE_INLINE V Min(V a, V b) { return (V)_mm256_min_pd((__m256d)a, (__m256d)b); }
#elif defined(__x86_64__)
GROUSER_LANE_INLINE V Sqrt(V x) { return (V)_mm_sqrt_pd((__m128d)x); }
GROUSER_LANE_INLINE V Max(V a, V b) { return (V)_mm_max_pd((__m128d)a, (__m128d)b); }
GROUSER_LANE_INLINE V Min(V a, V b) { return (V)_mm_min_pd((__m128d)a, (__m128d)b); }
#else
GROUSER_LANE_INLINE V Sqrt(V x) { return V{__builtin_sqrt(x[0]), __builtin_sqrt(x[1])}; }
GROUSER_LANE_INLINE V Max(V a, V b) { return a > b ? a : b; }
GROUSER_LANE_INLINE V Min(V a, V b) { return a < b ? a : b; }
#endif

GROUSER_LANE_INLINE V Abs(V x) { return x < 0 ? -x : x; }

// e^x for x <= 700, 0 or nearly below -700; relative error below 1e-12, exact at 0.
GROUSER_LANE_INLINE V Exp(V x) {
  x = Max(x, Set(-700));
  constexpr double kMagic = 6755399441055744.0;  // 1.5 * 2^52: rounds to integer
  const V shifted = x * 1.4426950408889634 + kMagic;
  const V k = shifted - kMagic;
  const V r = (x - k * 6.93147180369123816490e-01) - k * 1.90821492927058770002e-10;
  const V r2 = r * r;
  // Even and odd halves: two short chains instead of a long one.
  const V even =
      ((((r2 * (1.0 / 3628800) + 1.0 / 40320) * r2 + 1.0 / 720) * r2 + 1.0 / 24) * r2 + 0.5) * r2 +
      1.0;
  const V odd = (((r2 * (1.0 / 362880) + 1.0 / 5040) * r2 + 1.0 / 120) * r2 + 1.0 / 6) * r2 + 1.0;
  return (even + r * odd) * (V)(((Bits)shifted + 1023) << 52);
}

// ln x for normal positive x; absolute error below 1e-12 (1 + |ln x|).
GROUSER_LANE_INLINE V Log(V x) {
  constexpr unsigned long long kOffset = 0x3fe6a09e667f3bcd;  // sqrt(1/2)
  const Bits bits = (Bits)x;
  const Bits biased = (bits - kOffset + (1023ull << 52)) >> 52;
  const V e = (V)(biased | 0x4330000000000000ull) - (4503599627370496.0 + 1023.0);
  const V m = (V)(bits - ((biased - 1023) << 52));
  const V f = (m - 1.0) / (m + 1.0);
  const V f2 = f * f;
  V p = f2 * (1.0 / 13) + 1.0 / 11;
  p = p * f2 + 1.0 / 9;
  p = p * f2 + 1.0 / 7;
  p = p * f2 + 1.0 / 5;
  p = p * f2 + 1.0 / 3;
  p = p * f2 + 1.0;
  return 2.0 * f * p + e * 0.69314718055994530942;
}

// sin and cos of x and of x/2 squared; |x| <= 1.8, errors below 1e-11.
struct Angle {
  V sin, cos, half_sin2;
};
GROUSER_LANE_INLINE Angle SinCos(V x) {
  const V h = 0.5 * x, y = h * h;
  V s = y * (1.0 / 6227020800) - 1.0 / 39916800;
  s = s * y + 1.0 / 362880;
  s = s * y - 1.0 / 5040;
  s = s * y + 1.0 / 120;
  s = s * y - 1.0 / 6;
  s = (s * y + 1.0) * h;
  V c = y * (1.0 / 479001600) - 1.0 / 3628800;
  c = c * y + 1.0 / 40320;
  c = c * y - 1.0 / 720;
  c = c * y + 1.0 / 24;
  c = c * y - 0.5;
  c = c * y + 1.0;
  const V s2 = s * s;
  return {2.0 * s * c, 1.0 - 2.0 * s2, s2};
}

}  // namespace grouser::surrogate::GROUSER_ISA_NS
