#pragma once

#include <bit>
#include <cstdint>

/// exp, log, sin and cos that a compiler can vectorise: straight-line code of
/// + - x / and bit operations, so every instruction set gives the same bits.
/// Arguments outside the stated ranges give finite nonsense, never a trap.
namespace grouser::surrogate::vector_math {

#define GROUSER_INLINE [[gnu::always_inline]] inline

/// e^x for |x| <= 700, clamped outside; relative error below 1e-14.
GROUSER_INLINE double Exp(double x) {
  x = x > 700 ? 700 : x;
  x = x < -700 ? -700 : x;
  constexpr double kMagic = 6755399441055744.0;  // 1.5 * 2^52: rounds to integer
  const double shifted = x * 1.4426950408889634 + kMagic;
  const double k = shifted - kMagic;
  const double r = (x - k * 6.93147180369123816490e-01) - k * 1.90821492927058770002e-10;
  double p = 1.0 / 6227020800.0;
  p = p * r + 1.0 / 479001600.0;
  p = p * r + 1.0 / 39916800.0;
  p = p * r + 1.0 / 3628800.0;
  p = p * r + 1.0 / 362880.0;
  p = p * r + 1.0 / 40320.0;
  p = p * r + 1.0 / 5040.0;
  p = p * r + 1.0 / 720.0;
  p = p * r + 1.0 / 120.0;
  p = p * r + 1.0 / 24.0;
  p = p * r + 1.0 / 6.0;
  p = p * r + 0.5;
  p = p * r + 1.0;
  p = p * r + 1.0;
  // The integer stands in the low bits of `shifted`: build 2^k from it.
  return p * std::bit_cast<double>((std::bit_cast<std::uint64_t>(shifted) + 1023) << 52);
}

/// ln x for normal positive x; absolute error below 1e-14 (1 + |ln x|).
GROUSER_INLINE double Log(double x) {
  constexpr std::uint64_t kOffset = 0x3fe6a09e667f3bcd;  // sqrt(1/2)
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(x);
  const std::uint64_t biased = (bits - kOffset + (std::uint64_t{1023} << 52)) >> 52;
  const double e =
      std::bit_cast<double>(biased | 0x4330000000000000u) - (4503599627370496.0 + 1023.0);
  const double m = std::bit_cast<double>(bits - ((biased - 1023) << 52));
  const double f = (m - 1) / (m + 1);
  const double f2 = f * f;
  double p = 1.0 / 21;
  p = p * f2 + 1.0 / 19;
  p = p * f2 + 1.0 / 17;
  p = p * f2 + 1.0 / 15;
  p = p * f2 + 1.0 / 13;
  p = p * f2 + 1.0 / 11;
  p = p * f2 + 1.0 / 9;
  p = p * f2 + 1.0 / 7;
  p = p * f2 + 1.0 / 5;
  p = p * f2 + 1.0 / 3;
  p = p * f2 + 1.0;
  return 2 * f * p + e * 0.69314718055994530942;
}

/// sin x for |x| <= 2; error below 1e-14.
GROUSER_INLINE double Sin(double x) {
  const double y = x * x;
  double p = 1.0 / 51090942171709440000.0;
  p = p * -y + 1.0 / 121645100408832000.0;
  p = p * -y + 1.0 / 355687428096000.0;
  p = p * -y + 1.0 / 1307674368000.0;
  p = p * -y + 1.0 / 6227020800.0;
  p = p * -y + 1.0 / 39916800.0;
  p = p * -y + 1.0 / 362880.0;
  p = p * -y + 1.0 / 5040.0;
  p = p * -y + 1.0 / 120.0;
  p = p * -y + 1.0 / 6.0;
  p = p * -y + 1.0;
  return p * x;
}

/// cos x for |x| <= 2; error below 1e-14.
GROUSER_INLINE double Cos(double x) {
  const double y = x * x;
  double p = 1.0 / 1124000727777607680000.0;
  p = p * -y + 1.0 / 2432902008176640000.0;
  p = p * -y + 1.0 / 6402373705728000.0;
  p = p * -y + 1.0 / 20922789888000.0;
  p = p * -y + 1.0 / 87178291200.0;
  p = p * -y + 1.0 / 479001600.0;
  p = p * -y + 1.0 / 3628800.0;
  p = p * -y + 1.0 / 40320.0;
  p = p * -y + 1.0 / 720.0;
  p = p * -y + 1.0 / 24.0;
  p = p * -y + 0.5;
  return 1.0 - y * p;
}

}  // namespace grouser::surrogate::vector_math
