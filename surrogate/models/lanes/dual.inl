// Values with N first derivatives, for the few quantities a block has once;
// the loops over contact points are written out by hand.
#pragma once

#include "surrogate/models/lanes/vector.inl"

namespace grouser::surrogate::GROUSER_ISA_NS {

template <int N>
struct Dual {
  V v;
  V d[N == 0 ? 1 : N];
};

template <int N>
GROUSER_LANE_INLINE Dual<N> Constant(V v) {
  Dual<N> r{v, {}};
  return r;
}

// f(x) with derivative `slope`.
template <int N>
GROUSER_LANE_INLINE Dual<N> Chain(const Dual<N>& x, V value, V slope) {
  Dual<N> r;
  r.v = value;
  for (int k = 0; k < N; ++k) r.d[k] = slope * x.d[k];
  return r;
}

template <int N>
GROUSER_LANE_INLINE Dual<N> operator+(const Dual<N>& a, const Dual<N>& b) {
  Dual<N> r;
  r.v = a.v + b.v;
  for (int k = 0; k < N; ++k) r.d[k] = a.d[k] + b.d[k];
  return r;
}

template <int N>
GROUSER_LANE_INLINE Dual<N> operator-(const Dual<N>& a, const Dual<N>& b) {
  Dual<N> r;
  r.v = a.v - b.v;
  for (int k = 0; k < N; ++k) r.d[k] = a.d[k] - b.d[k];
  return r;
}

template <int N>
GROUSER_LANE_INLINE Dual<N> operator*(const Dual<N>& a, const Dual<N>& b) {
  Dual<N> r;
  r.v = a.v * b.v;
  for (int k = 0; k < N; ++k) r.d[k] = a.d[k] * b.v + a.v * b.d[k];
  return r;
}

template <int N>
GROUSER_LANE_INLINE Dual<N> operator*(double a, const Dual<N>& b) {
  return Chain(b, a * b.v, Set(a));
}

template <int N>
GROUSER_LANE_INLINE Dual<N> operator+(double a, const Dual<N>& b) {
  return Chain(b, a + b.v, Set(1));
}

template <int N>
GROUSER_LANE_INLINE Dual<N> operator-(const Dual<N>& a) {
  return Chain(a, -a.v, Set(-1));
}

template <int N>
GROUSER_LANE_INLINE Dual<N> Reciprocal(const Dual<N>& a) {
  const V inverse = 1.0 / a.v;
  return Chain(a, inverse, -inverse * inverse);
}

template <int N>
GROUSER_LANE_INLINE Dual<N> Abs(const Dual<N>& a) {
  return Chain(a, Abs(a.v), a.v < 0 ? Set(-1) : Set(1));
}

template <int N>
GROUSER_LANE_INLINE Dual<N> Exp(const Dual<N>& a) {
  const V e = Exp(a.v);
  return Chain(a, e, e);
}

// Corners of BekkerModel: max(0, x) with a continuous slope, smooth maximum.
inline constexpr double kCorner = 0.05;

template <int N>
GROUSER_LANE_INLINE Dual<N> Positive(const Dual<N>& x) {
  const V up = Max(x.v, V{}), inverse = 1.0 / (up + kCorner);
  return Chain(x, up * up * inverse, up * (up + 2 * kCorner) * inverse * inverse);
}

template <int N>
GROUSER_LANE_INLINE Dual<N> SmoothMax(const Dual<N>& a, const Dual<N>& b) {
  const V gap = a.v - b.v, root = Sqrt(gap * gap + kCorner * kCorner);
  const V share = 0.5 + 0.5 * gap / root;  // of a
  Dual<N> r;
  r.v = 0.5 * (a.v + b.v + root);
  for (int k = 0; k < N; ++k) r.d[k] = share * a.d[k] + (1.0 - share) * b.d[k];
  return r;
}

}  // namespace grouser::surrogate::GROUSER_ISA_NS
