#pragma once

#include "surrogate/models/number.h"

namespace grouser::surrogate {

/// A number with its first derivatives in N directions (forward-mode automatic
/// differentiation): v + sum d[k] e_k, e_k e_l = 0. V: double or a pack (number.h).
template <class V, int N>
struct Dual {
  V v;
  V d[N == 0 ? 1 : N];
};

template <Plain V>
GROUSER_INLINE V Value(V x) {
  return x;
}
template <class V, int N>
GROUSER_INLINE V Value(const Dual<V, N>& x) {
  return x.v;
}

/// The number x, whose derivatives are 0.
template <class T>
GROUSER_INLINE T Constant(Base<T> x) {
  if constexpr (Plain<T>) {
    return x;
  } else {
    T r{x, {}};
    return r;
  }
}
/// The number x that changes with direction k alone, at `slope`.
template <class T>
GROUSER_INLINE T Seed(Base<T> x, [[maybe_unused]] int k, [[maybe_unused]] Base<T> slope) {
  T r = Constant<T>(x);
  if constexpr (!Plain<T>) r.d[k] = slope;
  return r;
}

namespace number {
/// f(k) for k in [0, N): written out where N is small, or a Dual would stay in memory.
template <int N, class F>
GROUSER_INLINE void Each(const F& f) {
  if constexpr (N > 4) {
    for (int k = 0; k < N; ++k) f(k);
  } else {
    if constexpr (N > 0) f(0);
    if constexpr (N > 1) f(1);
    if constexpr (N > 2) f(2);
    if constexpr (N > 3) f(3);
  }
}
}  // namespace number
#define GROUSER_EACH(N, body) number::Each<N>([&](int k) __attribute__((always_inline)) { body; })

/// f(x) with derivative `slope`.
template <class V, int N>
GROUSER_INLINE Dual<V, N> Chain(const Dual<V, N>& x, V value, V slope) {
  Dual<V, N> r;
  r.v = value;
  GROUSER_EACH(N, r.d[k] = slope * x.d[k]);
  return r;
}

template <class V, int N>
GROUSER_INLINE Dual<V, N> operator+(const Dual<V, N>& a, const Dual<V, N>& b) {
  Dual<V, N> r;
  r.v = a.v + b.v;
  GROUSER_EACH(N, r.d[k] = a.d[k] + b.d[k]);
  return r;
}
template <class V, int N>
GROUSER_INLINE Dual<V, N> operator-(const Dual<V, N>& a, const Dual<V, N>& b) {
  Dual<V, N> r;
  r.v = a.v - b.v;
  GROUSER_EACH(N, r.d[k] = a.d[k] - b.d[k]);
  return r;
}
template <class V, int N>
GROUSER_INLINE Dual<V, N> operator*(const Dual<V, N>& a, const Dual<V, N>& b) {
  Dual<V, N> r;
  r.v = a.v * b.v;
  GROUSER_EACH(N, r.d[k] = a.d[k] * b.v + a.v * b.d[k]);
  return r;
}
template <class V, int N>
GROUSER_INLINE Dual<V, N> operator/(const Dual<V, N>& a, const Dual<V, N>& b) {
  const V inverse = 1.0 / b.v;
  Dual<V, N> r;
  r.v = a.v / b.v;
  GROUSER_EACH(N, r.d[k] = (a.d[k] - r.v * b.d[k]) * inverse);
  return r;
}
template <class V, int N>
GROUSER_INLINE Dual<V, N> operator-(const Dual<V, N>& a) {
  Dual<V, N> r;
  r.v = -a.v;
  GROUSER_EACH(N, r.d[k] = -a.d[k]);
  return r;
}

// With a number that has no derivatives.
template <class V, int N, Plain S>
GROUSER_INLINE Dual<V, N> operator+(Dual<V, N> a, S b) {
  a.v = a.v + b;
  return a;
}
template <class V, int N, Plain S>
GROUSER_INLINE Dual<V, N> operator+(S a, Dual<V, N> b) {
  b.v = a + b.v;
  return b;
}
template <class V, int N, Plain S>
GROUSER_INLINE Dual<V, N> operator-(Dual<V, N> a, S b) {
  a.v = a.v - b;
  return a;
}
template <class V, int N, Plain S>
GROUSER_INLINE Dual<V, N> operator-(S a, const Dual<V, N>& b) {
  Dual<V, N> r = -b;
  r.v = a - b.v;
  return r;
}
template <class V, int N, Plain S>
GROUSER_INLINE Dual<V, N> operator*(Dual<V, N> a, S b) {
  a.v = a.v * b;
  GROUSER_EACH(N, a.d[k] = a.d[k] * b);
  return a;
}
template <class V, int N, Plain S>
GROUSER_INLINE Dual<V, N> operator*(S a, Dual<V, N> b) {
  b.v = a * b.v;
  GROUSER_EACH(N, b.d[k] = a * b.d[k]);
  return b;
}
template <class V, int N, Plain S>
GROUSER_INLINE Dual<V, N> operator/(S a, const Dual<V, N>& b) {
  const V value = a / b.v;
  return Chain(b, value, -value / b.v);
}

template <class V, int N>
GROUSER_INLINE Dual<V, N> Select(Mask<V> mask, const Dual<V, N>& a, const Dual<V, N>& b) {
  Dual<V, N> r;
  r.v = Select(mask, a.v, b.v);
  GROUSER_EACH(N, r.d[k] = Select(mask, a.d[k], b.d[k]));
  return r;
}
template <class V, int N>
GROUSER_INLINE Dual<V, N> Max(const Dual<V, N>& a, const Dual<V, N>& b) {
  return Select(a.v > b.v, a, b);
}
template <class V, int N>
GROUSER_INLINE Dual<V, N> Abs(const Dual<V, N>& a) {
  return Select(a.v < 0, -a, a);
}
template <class V, int N>
GROUSER_INLINE Dual<V, N> Sqrt(const Dual<V, N>& a) {
  const V root = Sqrt(a.v);
  return Chain(a, root, 0.5 / root);
}
template <class V, int N>
GROUSER_INLINE Dual<V, N> Exp(const Dual<V, N>& a) {
  const V e = Exp(a.v);
  return Chain(a, e, e);
}
template <class V, int N>
GROUSER_INLINE Dual<V, N> Rise(const Dual<V, N>& a) {
  const V rise = Rise(a.v);
  return Chain(a, rise, V(1.0 - rise));
}
template <class V, int N>
GROUSER_INLINE Dual<V, N> Log(const Dual<V, N>& a) {
  return Chain(a, Log(a.v), V(1.0 / a.v));
}
template <class V, int N>
GROUSER_INLINE Dual<V, N> DecayMean(const Dual<V, N>& a) {
  const DecayTerms<V> at = Decay(a.v);
  return Chain(a, at.mean, at.slope);
}
template <class V, int N>
GROUSER_INLINE Angle<Dual<V, N>> SinCos(const Dual<V, N>& a) {
  const Angle<V> at = SinCos(a.v);
  return {Chain(a, at.sin, at.cos), Chain(a, at.cos, V(-at.sin)),
          Chain(a, at.half_sin2, V(0.5 * at.sin))};
}

}  // namespace grouser::surrogate
