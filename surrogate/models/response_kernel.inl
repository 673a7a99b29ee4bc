// The kernel of the response table: included once per instruction set by a
// file that defines GROUSER_ISA_NS. No library code: see response_kernel.h.
#define GROUSER_INLINE [[gnu::always_inline]] inline

namespace grouser::surrogate::response::GROUSER_ISA_NS {
namespace {

#include "surrogate/models/response_chart.inl"
#include "surrogate/models/response_outputs.inl"

typedef float Lanes __attribute__((vector_size(4 * kGroup)));  // one node

// All channels of one state: the 4 x 4 x 4 nodes around it, load innermost.
GROUSER_INLINE void SumValue(const Constants& c, const Scratch& s, int i, Lanes* out) {
  const float (*w)[4][kBlock] = s.weight;
  const float *w_d = &w[0][0][i], *w_l = &w[1][0][i], *w_k = &w[2][0][i];
  const float* corner = c.nodes + s.node[i];
  Lanes sum{};
  for (int d = 0; d < 4; ++d) {
    Lanes plane{};
    for (int l = 0; l < 4; ++l) {
      const Lanes* p =
          reinterpret_cast<const Lanes*>(corner + d * c.direction_stride + l * c.lateral_stride);
      const Lanes line = (w_k[0] * p[0] + w_k[kBlock] * p[1]) +
                         (w_k[2 * kBlock] * p[2] + w_k[3 * kBlock] * p[3]);
      plane += w_l[l * kBlock] * line;
    }
    sum += w_d[d * kBlock] * plane;
  }
  *out = sum;
}

// The same and its slopes by direction, lateral and log load.
GROUSER_INLINE void SumSlopes(const Constants& c, const Scratch& s, int i, Lanes* out) {
  const float *w_d = &s.weight[0][0][i], *w_l = &s.weight[1][0][i], *w_k = &s.weight[2][0][i];
  const float *s_d = &s.slope[0][0][i], *s_l = &s.slope[1][0][i], *s_k = &s.slope[2][0][i];
  const float* corner = c.nodes + s.node[i];
  Lanes sum{}, by_d{}, by_l{}, by_k{};
  for (int d = 0; d < 4; ++d) {
    Lanes plane{}, plane_l{}, plane_k{};
    for (int l = 0; l < 4; ++l) {
      const Lanes* p =
          reinterpret_cast<const Lanes*>(corner + d * c.direction_stride + l * c.lateral_stride);
      const Lanes line = (w_k[0] * p[0] + w_k[kBlock] * p[1]) +
                         (w_k[2 * kBlock] * p[2] + w_k[3 * kBlock] * p[3]);
      const Lanes line_k = (s_k[0] * p[0] + s_k[kBlock] * p[1]) +
                           (s_k[2 * kBlock] * p[2] + s_k[3 * kBlock] * p[3]);
      plane += w_l[l * kBlock] * line;
      plane_l += s_l[l * kBlock] * line;
      plane_k += w_l[l * kBlock] * line_k;
    }
    sum += w_d[d * kBlock] * plane;
    by_d += s_d[d * kBlock] * plane;
    by_l += w_d[d * kBlock] * plane_l;
    by_k += w_d[d * kBlock] * plane_k;
  }
  out[0] = sum;
  out[kGroup] = by_d;
  out[2 * kGroup] = by_l;
  out[3 * kGroup] = by_k;
}

// Rows (states) to columns (channels), 8 x 8.
GROUSER_INLINE void Transpose(const Lanes* in, float (*channel)[kBlock], int first) {
  Lanes a[kGroup], b[kGroup];
  for (int i = 0; i < kGroup; i += 2) {
    a[i] = __builtin_shufflevector(in[i], in[i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
    a[i + 1] = __builtin_shufflevector(in[i], in[i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
  }
  for (int i = 0; i < kGroup; i += 4) {
    for (int k = 0; k < 2; ++k) {
      b[i + 2 * k] = __builtin_shufflevector(a[i + k], a[i + k + 2], 0, 1, 8, 9, 4, 5, 12, 13);
      b[i + 2 * k + 1] =
          __builtin_shufflevector(a[i + k], a[i + k + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    }
  }
  for (int i = 0; i < 4; ++i) {
    const Lanes low = __builtin_shufflevector(b[i], b[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    const Lanes high = __builtin_shufflevector(b[i], b[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    *reinterpret_cast<Lanes*>(&channel[i][first]) = low;
    *reinterpret_cast<Lanes*>(&channel[i + 4][first]) = high;
  }
}

template <bool kGradients>
GROUSER_INLINE void Run(const Constants& c, Block* b, Scratch* s, Unwanted* unwanted) {
  const int n = b->groups * kGroup;
  ToCanonical(c, b, s, n);
  ToChart(c, s, n);
  for (int i = 0; i < n; ++i) s->node[i] = 0;
  ToWeights<kGradients>(s->direction, c.direction, c.direction_stride, 1, s->weight[0],
                        s->slope[0], s->node, n);
  ToWeights<kGradients>(s->height, c.lateral, c.lateral_stride, 1, s->weight[1], s->slope[1],
                        s->node, n);
  ToWeights<kGradients>(s->log_load, c.load, kGroup, 0, s->weight[2], s->slope[2], s->node, n);
  for (int first = 0; first < n; first += kGroup) {
    Lanes sums[4 * kGroup];
    for (int k = 0; k < kGroup; ++k) {
      if (kGradients) {
        SumSlopes(c, *s, first + k, sums + k);
      } else {
        SumValue(c, *s, first + k, sums + k);
      }
    }
    for (int k = 0; k < (kGradients ? 4 : 1); ++k) {
      Transpose(sums + k * kGroup, s->channel[k], first);
    }
  }
  Judge(c, b, s, n);
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
    WriteEchoes(*block, scratch, &unwanted, block->groups * kGroup);
  }
}

}  // namespace grouser::surrogate::response::GROUSER_ISA_NS
