// Grains and records between memory, one after another, and lanes, field by
// field. The same moves by three sets of instructions; no arithmetic.
// Part of the kernels: compiled once per instruction set.
#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace grouser::dem::GROUSER_ISA_NS {
namespace {

constexpr int L = kLanes;
static_assert(L == 16, "the AVX-512 moves are written for 16 lanes");

/// Grains as structure of arrays; fields in the order of Grain.
struct alignas(64) Lanes {
  std::int32_t x[L], y[L], z[L];
  float radius[L], vx[L], vy[L], vz[L], mass[L], wx[L], wy[L], wz[L];
  std::int32_t kind[L];
};
/// Loads as structure of arrays; fields in the order of GrainLoad.
struct alignas(64) LoadLanes {
  float fx[L], fy[L], fz[L], deepest[L], tx[L], ty[L], tz[L], touching[L];
};

#if defined(__AVX512F__)

/// 16 rows of 16 floats; on return row 4 q + e holds column 4 q + e.
inline __attribute__((always_inline)) void Transpose(__m512 (&r)[16]) {
  __m512 u[4][4];
  for (int k = 0; k < 4; ++k) {
    const __m512* a = r + 4 * k;
    const __m512d t0 = _mm512_castps_pd(_mm512_unpacklo_ps(a[0], a[1]));
    const __m512d t1 = _mm512_castps_pd(_mm512_unpackhi_ps(a[0], a[1]));
    const __m512d t2 = _mm512_castps_pd(_mm512_unpacklo_ps(a[2], a[3]));
    const __m512d t3 = _mm512_castps_pd(_mm512_unpackhi_ps(a[2], a[3]));
    u[k][0] = _mm512_castpd_ps(_mm512_unpacklo_pd(t0, t2));
    u[k][1] = _mm512_castpd_ps(_mm512_unpackhi_pd(t0, t2));
    u[k][2] = _mm512_castpd_ps(_mm512_unpacklo_pd(t1, t3));
    u[k][3] = _mm512_castpd_ps(_mm512_unpackhi_pd(t1, t3));
  }
  for (int e = 0; e < 4; ++e) {
    const __m512 v0 = _mm512_shuffle_f32x4(u[0][e], u[1][e], 0x44);
    const __m512 v1 = _mm512_shuffle_f32x4(u[2][e], u[3][e], 0x44);
    const __m512 v2 = _mm512_shuffle_f32x4(u[0][e], u[1][e], 0xee);
    const __m512 v3 = _mm512_shuffle_f32x4(u[2][e], u[3][e], 0xee);
    r[e] = _mm512_shuffle_f32x4(v0, v1, 0x88);
    r[4 + e] = _mm512_shuffle_f32x4(v0, v1, 0xdd);
    r[8 + e] = _mm512_shuffle_f32x4(v2, v3, 0x88);
    r[12 + e] = _mm512_shuffle_f32x4(v2, v3, 0xdd);
  }
}

/// Whole lines are loaded and turned: fewer, longer loads beat masked loads of
/// their quarters by 8 % (docs/performance.md).
inline __attribute__((always_inline)) void Gather(const Grain* g, const std::int32_t* at,
                                                  Lanes& out) {
  __m512 r[16];
  for (int l = 0; l < L; ++l) r[l] = _mm512_load_ps(reinterpret_cast<const float*>(g + at[l]));
  Transpose(r);
  float* to = reinterpret_cast<float*>(&out);
  for (int f = 0; f < 12; ++f) _mm512_store_ps(to + f * L, r[f]);
}

inline __attribute__((always_inline)) void Scatter(const LoadLanes& in, const std::int32_t* at,
                                                   GrainLoad* to) {
  const float* f = reinterpret_cast<const float*>(&in);
  __m512d u[2][4];
  for (int h = 0; h < 2; ++h) {
    __m512 a[4];
    for (int k = 0; k < 4; ++k) a[k] = _mm512_load_ps(f + (4 * h + k) * L);
    const __m512d t0 = _mm512_castps_pd(_mm512_unpacklo_ps(a[0], a[1]));
    const __m512d t1 = _mm512_castps_pd(_mm512_unpackhi_ps(a[0], a[1]));
    const __m512d t2 = _mm512_castps_pd(_mm512_unpacklo_ps(a[2], a[3]));
    const __m512d t3 = _mm512_castps_pd(_mm512_unpackhi_ps(a[2], a[3]));
    u[h][0] = _mm512_unpacklo_pd(t0, t2);
    u[h][1] = _mm512_unpackhi_pd(t0, t2);
    u[h][2] = _mm512_unpacklo_pd(t1, t3);
    u[h][3] = _mm512_unpackhi_pd(t1, t3);
  }
  const __m512i low = _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11);
  const __m512i high = _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15);
  for (int e = 0; e < 4; ++e) {
    const __m512d a = _mm512_permutex2var_pd(u[0][e], low, u[1][e]);
    const __m512d b = _mm512_permutex2var_pd(u[0][e], high, u[1][e]);
    _mm256_store_pd(reinterpret_cast<double*>(to + at[e]), _mm512_castpd512_pd256(a));
    _mm256_store_pd(reinterpret_cast<double*>(to + at[4 + e]), _mm512_extractf64x4_pd(a, 1));
    _mm256_store_pd(reinterpret_cast<double*>(to + at[8 + e]), _mm512_castpd512_pd256(b));
    _mm256_store_pd(reinterpret_cast<double*>(to + at[12 + e]), _mm512_extractf64x4_pd(b, 1));
  }
}

#elif defined(__SSE2__)

/// Four rows of four floats become four columns.
inline __attribute__((always_inline)) void Turn(const float* a, const float* b, const float* c,
                                                const float* d, float* p, float* q, float* r,
                                                float* s) {
  __m128 r0 = _mm_load_ps(a), r1 = _mm_load_ps(b), r2 = _mm_load_ps(c), r3 = _mm_load_ps(d);
  _MM_TRANSPOSE4_PS(r0, r1, r2, r3);
  _mm_store_ps(p, r0);
  _mm_store_ps(q, r1);
  _mm_store_ps(r, r2);
  _mm_store_ps(s, r3);
}

inline __attribute__((always_inline)) void Gather(const Grain* g, const std::int32_t* at,
                                                  Lanes& out) {
  float* to = reinterpret_cast<float*>(&out);
  for (int l = 0; l < L; l += 4) {
    const float* r[4];
    for (int k = 0; k < 4; ++k) r[k] = reinterpret_cast<const float*>(g + at[l + k]);
    for (int f = 0; f < 12; f += 4) {
      float* p = to + f * L + l;
      Turn(r[0] + f, r[1] + f, r[2] + f, r[3] + f, p, p + L, p + 2 * L, p + 3 * L);
    }
  }
}

inline __attribute__((always_inline)) void Scatter(const LoadLanes& in, const std::int32_t* at,
                                                   GrainLoad* to) {
  const float* from = reinterpret_cast<const float*>(&in);
  for (int l = 0; l < L; l += 4) {
    float* r[4];
    for (int k = 0; k < 4; ++k) r[k] = reinterpret_cast<float*>(to + at[l + k]);
    for (int f = 0; f < 8; f += 4) {
      const float* p = from + f * L + l;
      Turn(p, p + L, p + 2 * L, p + 3 * L, r[0] + f, r[1] + f, r[2] + f, r[3] + f);
    }
  }
}

#else

/// Fields first, first + 1, ... of one row to lane l of as many columns; and back.
template <class Row>
void Turn(const Row* from, int first, int fields, int l, void* to) {
  for (int f = 0; f < fields; ++f) {
    __builtin_memcpy(static_cast<char*>(to) + 4 * (f * L + l),
                     reinterpret_cast<const char*>(from) + 4 * (first + f), 4);
  }
}
template <class Row>
void TurnBack(const void* from, int first, int fields, int l, Row* to) {
  for (int f = 0; f < fields; ++f) {
    __builtin_memcpy(reinterpret_cast<char*>(to) + 4 * (first + f),
                     static_cast<const char*>(from) + 4 * (f * L + l), 4);
  }
}

inline void Gather(const Grain* g, const std::int32_t* at, Lanes& out) {
  for (int l = 0; l < L; ++l) Turn(g + at[l], 0, 12, l, &out);
}
inline void Scatter(const LoadLanes& in, const std::int32_t* at, GrainLoad* to) {
  for (int l = 0; l < L; ++l) TurnBack(&in, 0, 8, l, to + at[l]);
}

#endif

}  // namespace
}  // namespace grouser::dem::GROUSER_ISA_NS
