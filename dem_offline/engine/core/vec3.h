#pragma once

/// The one macro of the engine: a function that host and device share.
#if defined(__CUDACC__)
#define GROUSER_HD __host__ __device__ inline
#else
#define GROUSER_HD inline __attribute__((always_inline))
#endif

namespace grouser::dem {

/// Three floats; forces [N], velocities [m/s], unit vectors [-].
struct Vec3f {
  float x, y, z;
};

GROUSER_HD Vec3f operator+(Vec3f a, Vec3f b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
GROUSER_HD Vec3f operator-(Vec3f a, Vec3f b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
GROUSER_HD Vec3f operator*(float s, Vec3f a) { return {s * a.x, s * a.y, s * a.z}; }
GROUSER_HD float Dot(Vec3f a, Vec3f b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
GROUSER_HD Vec3f Cross(Vec3f a, Vec3f b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// By component: a choice between two whole structs would not vectorise.
GROUSER_HD Vec3f Select(bool first, Vec3f a, Vec3f b) {
  return {first ? a.x : b.x, first ? a.y : b.y, first ? a.z : b.z};
}
GROUSER_HD float Max(float a, float b) { return a > b ? a : b; }
GROUSER_HD float Min(float a, float b) { return a < b ? a : b; }
GROUSER_HD float Sqrt(float a) {
#if defined(__CUDA_ARCH__)
  return sqrtf(a);  // correctly rounded too (-prec-sqrt=true is nvcc's default)
#else
  return __builtin_sqrtf(a);
#endif
}

/// The part of `a` normal to the unit vector `n`, stretched to the length of
/// `a`: carries a tangential history along as its contact plane turns.
/// Commutes with a change of sign of `n`, so both sides of a contact agree.
GROUSER_HD Vec3f TurnIntoPlane(Vec3f a, Vec3f n) {
  const Vec3f t = a - Dot(a, n) * n;
  const float before = Dot(a, a), after = Dot(t, t);
  const float scale = after > 1e-30f ? Sqrt(before / Max(after, 1e-30f)) : 0.0f;
  return scale * t;
}

}  // namespace grouser::dem
