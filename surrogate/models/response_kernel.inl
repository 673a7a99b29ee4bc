// The kernel of the response table: included once per instruction set by a
// file that defines GROUSER_ISA_NS. No library code: see response_kernel.h.
#define GROUSER_INLINE [[gnu::always_inline]] inline

namespace grouser::surrogate::response::GROUSER_ISA_NS {
namespace {

#include "surrogate/models/response_chart.inl"
#include "surrogate/models/response_outputs.inl"

constexpr int kSquare = kGroup * kGroup;

// States of a block with those that fill its last group.
GROUSER_INLINE int Padded(const Block& b) { return (b.count + kGroup - 1) / kGroup * kGroup; }

// A node is one vector, or two where the set has no more than four lanes.
#if defined(__AVX2__)
constexpr int kWide = kGroup;
#else
constexpr int kWide = kGroup / 2;
#endif
typedef float Lanes __attribute__((vector_size(4 * kWide)));

GROUSER_INLINE const Lanes& At(const float* p) { return *reinterpret_cast<const Lanes*>(p); }
GROUSER_INLINE Lanes& At(float* p) { return *reinterpret_cast<Lanes*>(p); }

// One line of four nodes along the load.
GROUSER_INLINE Lanes Line(const float* p, const float* w) {
  return (w[0] * At(p) + w[kBlock] * At(p + kGroup)) +
         (w[2 * kBlock] * At(p + 2 * kGroup) + w[3 * kBlock] * At(p + 3 * kGroup));
}

// All channels of one state: the 4 x 4 x 4 nodes around it, load innermost.
GROUSER_INLINE void SumValue(const Constants& c, const float* nodes, const Scratch& s, int i,
                             float* row) {
  const float *w_d = &s.weight[0][0][i], *w_l = &s.weight[1][0][i], *w_k = &s.weight[2][0][i];
  for (int lane = 0; lane < kGroup; lane += kWide) {
    const float* corner = nodes + s.node[i] + lane;
    Lanes sum{};
    for (int d = 0; d < 4; ++d) {
      const float* p = corner + d * c.direction_stride;
      Lanes plane{};
      for (int l = 0; l < 4; ++l, p += c.lateral_stride) plane += w_l[l * kBlock] * Line(p, w_k);
      sum += w_d[d * kBlock] * plane;
    }
    At(row + lane) = sum;
  }
}

// The same and its slopes by direction, lateral and log load.
GROUSER_INLINE void SumSlopes(const Constants& c, const float* nodes, const Scratch& s, int i,
                              float* row) {
  const float *w_d = &s.weight[0][0][i], *w_l = &s.weight[1][0][i], *w_k = &s.weight[2][0][i];
  const float *s_d = &s.slope[0][0][i], *s_l = &s.slope[1][0][i], *s_k = &s.slope[2][0][i];
  for (int lane = 0; lane < kGroup; lane += kWide) {
    const float* corner = nodes + s.node[i] + lane;
    Lanes sum{}, by_d{}, by_l{}, by_k{};
    for (int d = 0; d < 4; ++d) {
      const float* p = corner + d * c.direction_stride;
      Lanes plane{}, plane_l{}, plane_k{};
      for (int l = 0; l < 4; ++l, p += c.lateral_stride) {
        const Lanes line = Line(p, w_k);
        plane += w_l[l * kBlock] * line;
        plane_l += s_l[l * kBlock] * line;
        plane_k += w_l[l * kBlock] * Line(p, s_k);
      }
      sum += w_d[d * kBlock] * plane;
      by_d += s_d[d * kBlock] * plane;
      by_l += w_d[d * kBlock] * plane_l;
      by_k += w_d[d * kBlock] * plane_k;
    }
    At(row + lane) = sum;
    At(row + kSquare + lane) = by_d;
    At(row + 2 * kSquare + lane) = by_l;
    At(row + 3 * kSquare + lane) = by_k;
  }
}

// Adds what the speed does; keeps the rate itself, the slope by u.
template <bool kGradients>
GROUSER_INLINE void AddSpeed(const Constants& c, const Scratch& s, int i, float* row) {
  alignas(64) float rate[4 * kSquare];
  if (kGradients) {
    SumSlopes(c, c.rate, s, i, rate);
  } else {
    SumValue(c, c.rate, s, i, rate);
  }
  const float u = s.u[i];
  for (int lane = 0; lane < kGroup; lane += kWide) {
    for (int k = 0; k < (kGradients ? 4 : 1); ++k) {
      At(row + k * kSquare + lane) += u * At(rate + k * kSquare + lane);
    }
    if (kGradients) At(row + 4 * kSquare + lane) = At(rate + lane);
  }
}

// Rows (states) to columns (channels), 8 x 8.
GROUSER_INLINE void Transpose(const float* row, float (*channel)[kBlock], int first) {
#if defined(__AVX2__)
  Lanes a[kGroup], b[kGroup];
  for (int i = 0; i < kGroup; i += 2) {
    const Lanes x = At(row + i * kGroup), y = At(row + (i + 1) * kGroup);
    a[i] = __builtin_shufflevector(x, y, 0, 8, 1, 9, 4, 12, 5, 13);
    a[i + 1] = __builtin_shufflevector(x, y, 2, 10, 3, 11, 6, 14, 7, 15);
  }
  for (int i = 0; i < kGroup; i += 4) {
    for (int k = 0; k < 2; ++k) {
      b[i + 2 * k] = __builtin_shufflevector(a[i + k], a[i + k + 2], 0, 1, 8, 9, 4, 5, 12, 13);
      b[i + 2 * k + 1] =
          __builtin_shufflevector(a[i + k], a[i + k + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    }
  }
  for (int i = 0; i < 4; ++i) {
    At(&channel[i][first]) = __builtin_shufflevector(b[i], b[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    At(&channel[i + 4][first]) =
        __builtin_shufflevector(b[i], b[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
#else
  for (int k = 0; k < kGroup; ++k) {
    for (int i = 0; i < kGroup; ++i) channel[k][first + i] = row[i * kGroup + k];
  }
#endif
}

template <bool kGradients>
GROUSER_INLINE void Run(const Constants& c, Block* b, Scratch* s, Unwanted* unwanted) {
  const int n = Padded(*b);
  Admit(c, b, s, n);
  ToCanonical(c, s, n);
  ToSpeed<kGradients>(c, s, n);
  ToChart(c, s, n);
  for (int i = 0; i < n; ++i) s->node[i] = 0;
  ToWeights<kGradients>(s->direction, c.direction, c.direction_stride, 1, s->weight[0], s->slope[0],
                        s->node, n);
  ToWeights<kGradients>(s->height, c.lateral, c.lateral_stride, 1, s->weight[1], s->slope[1],
                        s->node, n);
  ToWeights<kGradients>(s->log_load, c.load, kGroup, 0, s->weight[2], s->slope[2], s->node, n);
  alignas(64) float row[5 * kSquare] = {};
  for (int first = 0; first < n; first += kGroup) {
    const int left = b->count - first, full = left < kGroup ? left : kGroup;
    for (int k = 0; k < full; ++k) {
      if (kGradients) {
        SumSlopes(c, c.nodes, *s, first + k, row + k * kGroup);
      } else {
        SumValue(c, c.nodes, *s, first + k, row + k * kGroup);
      }
      if (c.rate) AddSpeed<kGradients>(c, *s, first + k, row + k * kGroup);
    }
    for (int k = 0; k < (kGradients ? 5 : 1); ++k) {
      Transpose(row + k * kSquare, s->channel[k], first);
    }
  }
  FlagStates(c, b, s, n);
  Limit<kGradients>(b, s, n);
  WriteOutput<0>(c, *b, *s, unwanted, n);
  WriteOutput<1>(c, *b, *s, unwanted, n);
  WriteOutput<2>(c, *b, *s, unwanted, n);
  WriteOutput<3>(c, *b, *s, unwanted, n);
  WriteOutput<4>(c, *b, *s, unwanted, n);
  WriteOutput<5>(c, *b, *s, unwanted, n);
  if (!kGradients) return;
  WriteGradients<0>(c, *b, *s, unwanted, n);
  WriteGradients<1>(c, *b, *s, unwanted, n);
  WriteGradients<2>(c, *b, *s, unwanted, n);
  WriteGradients<3>(c, *b, *s, unwanted, n);
  WriteGradients<4>(c, *b, *s, unwanted, n);
  WriteGradients<5>(c, *b, *s, unwanted, n);
  MarkPole(b, *s, n);
}

}  // namespace

void Evaluate(const Constants& constants, Block* block) {
  Scratch scratch;
  Unwanted unwanted;
  if (block->gradients) {
    Run<true>(constants, block, &scratch, &unwanted);
  } else {
    Run<false>(constants, block, &scratch, &unwanted);
  }
  if (block->slip || block->attack_angle) {
    WriteEchoes(*block, scratch, &unwanted, Padded(*block));
  }
}

}  // namespace grouser::surrogate::response::GROUSER_ISA_NS
