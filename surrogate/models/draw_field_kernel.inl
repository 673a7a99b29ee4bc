// The unit errors of draw_field.h, eight features at a time: included once per instruction set.
// Sums are taken in one order, so that every set gives the same bits.
#include "surrogate/models/draw_field_kernel.h"
#include "surrogate/models/number.h"

namespace grouser::surrogate::draws::GROUSER_ISA_NS {
namespace {

typedef double Pack __attribute__((vector_size(GROUSER_LANES * sizeof(double))));
constexpr int kPacks = kFeatures / GROUSER_LANES;
constexpr int kSums = 8 / GROUSER_LANES;  // packs that hold eight partial sums

struct Wave {
  Pack sin, cos;
};
/// sin and cos of 2 pi t.
GROUSER_INLINE Wave WaveOf(Pack t) {
  constexpr double kMagic = 6755399441055744.0;  // 1.5 * 2^52: rounds to integer
  const Pack whole = (t + kMagic) - kMagic;
  const Angle<Pack> half = SinCos<Pack>((t - whole) * 3.14159265358979323846);
  return {2.0 * half.sin * half.cos, 1.0 - 2.0 * half.sin * half.sin};
}

/// Eight partial sums to one.
GROUSER_INLINE double Sum(const Pack (&sums)[kSums]) {
  double x[8];
  for (int k = 0; k < kSums; ++k) Store(x + k * GROUSER_LANES, sums[k]);
  return ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7]));
}

/// A sum over features and its derivatives by the coordinates: those of d (v_x, v_y, rim), ln load.
struct Sums {
  double value, by[4];
};

/// A state's features, without the load: by whether odd in (v_x, rim), and in v_y.
struct Features {
  Pack trig[2][2][kPacks];
  Sums size2[2][2];  ///< of their squares
  Wave load[kPacks];
  double d[3], per_speed, per_load;
};
constexpr double kTurn = 6.283185307179586;

/// Feature t of pack p by the phases of (v_x, rim) and of v_y.
struct Slopes {
  Pack plane, side;
};
GROUSER_INLINE Slopes SlopesOf(const Features& f, int odd_x, int odd_y, int p) {
  return {odd_x != 0 ? f.trig[0][odd_y][p] : -f.trig[1][odd_y][p],
          odd_y != 0 ? f.trig[odd_x][0][p] : -f.trig[odd_x][1][p]};
}

GROUSER_INLINE void Square(const Frequencies& w, int odd_x, int odd_y, bool slopes, Features* f) {
  Pack sum[kSums] = {}, by[3][kSums] = {};
  for (int p = 0; p < kPacks; ++p) {
    const int at = p * GROUSER_LANES, k = p % kSums;
    const Pack t = f->trig[odd_x][odd_y][p];
    sum[k] += t * t;
    if (!slopes) continue;
    const Slopes s = SlopesOf(*f, odd_x, odd_y, p);
    by[0][k] += t * s.plane * Load<Pack>(w.v_x + at);
    by[1][k] += t * s.side * Load<Pack>(w.v_y + at);
    by[2][k] += t * s.plane * Load<Pack>(w.rim + at);
  }
  f->size2[odd_x][odd_y].value = Sum(sum);
  for (int k = 0; k < 3; ++k) f->size2[odd_x][odd_y].by[k] = slopes ? 2 * kTurn * Sum(by[k]) : 0;
  f->size2[odd_x][odd_y].by[3] = 0;
}

GROUSER_INLINE void Fill(const Frequencies& w, const Block& b, int i, bool slopes, Features* f) {
  const double x = b.v_x[i], y = b.v_y[i], rim = b.rim[i];
  const double size = Sqrt<double>(x * x + y * y + rim * rim), per = size > 0 ? 1 / size : 0;
  const double load = Max<double>(b.load[i], 1e-300), log_load = Log<double>(load);
  f->d[0] = x * per;
  f->d[1] = y * per;
  f->d[2] = rim * per;
  f->per_speed = per;
  f->per_load = 1 / load;
  for (int p = 0; p < kPacks; ++p) {
    const int at = p * GROUSER_LANES;
    const Wave plane = WaveOf(Load<Pack>(w.v_x + at) * f->d[0] + Load<Pack>(w.rim + at) * f->d[2]);
    const Wave side = WaveOf(Load<Pack>(w.v_y + at) * f->d[1]);
    f->load[p] = WaveOf(Load<Pack>(w.load + at) * log_load);
    f->trig[0][0][p] = plane.cos * side.cos;
    f->trig[1][0][p] = plane.sin * side.cos;
    f->trig[0][1][p] = plane.cos * side.sin;
    f->trig[1][1][p] = plane.sin * side.sin;
  }
  for (int odd_x = 0; odd_x < 2; ++odd_x) {
    for (int odd_y = 0; odd_y < 2; ++odd_y) Square(w, odd_x, odd_y, slopes, f);
  }
}

GROUSER_INLINE Sums Dot(const Frequencies& w, const Features& f, int odd_x, int odd_y, bool slopes,
                        const Coefficients& c) {
  Pack sum[kSums] = {}, by[4][kSums] = {};
  for (int p = 0; p < kPacks; ++p) {
    const int at = p * GROUSER_LANES, k = p % kSums;
    const Pack a = Load<Pack>(c.a + at), b = Load<Pack>(c.b + at), t = f.trig[odd_x][odd_y][p];
    const Pack of_load = a * f.load[p].cos + b * f.load[p].sin;
    sum[k] += t * of_load;
    if (!slopes) continue;
    const Slopes s = SlopesOf(f, odd_x, odd_y, p);
    const Pack plane = s.plane * of_load;
    by[0][k] += plane * Load<Pack>(w.v_x + at);
    by[1][k] += s.side * of_load * Load<Pack>(w.v_y + at);
    by[2][k] += plane * Load<Pack>(w.rim + at);
    by[3][k] += t * (b * f.load[p].cos - a * f.load[p].sin) * Load<Pack>(w.load + at);
  }
  Sums sums{Sum(sum), {}};
  for (int k = 0; slopes && k < 4; ++k) sums.by[k] = kTurn * Sum(by[k]);
  return sums;
}

/// g and its derivatives by the coordinates.
GROUSER_INLINE Sums ErrorOf(const Frequencies& w, const Features& f, const Member& m, int output,
                            bool slopes) {
  const int odd_x = kOutputFields[output].parity_x < 0, odd_y = kOutputFields[output].parity_y < 0;
  Sums sums = Dot(w, f, odd_x, odd_y, slopes, m.own[output]), size2 = f.size2[odd_x][odd_y];
  if (odd_x != 0 || odd_y != 0) {
    const Sums broken = Dot(w, f, 0, 0, slopes, m.breaking[output]);
    sums.value += kBreaking * broken.value;
    size2.value += kBreaking * kBreaking * f.size2[0][0].value;
    for (int k = 0; k < 4; ++k) {
      sums.by[k] += kBreaking * broken.by[k];
      size2.by[k] += kBreaking * kBreaking * f.size2[0][0].by[k];
    }
  }
  const double per = 1 / Sqrt<double>(size2.value), half = 0.5 * sums.value / size2.value;
  Sums error{sums.value * per, {}};
  for (int k = 0; k < 4; ++k) error.by[k] = (sums.by[k] - half * size2.by[k]) * per;
  return error;
}

/// From derivatives by coordinates to those by the state: d is v over its length.
GROUSER_INLINE void WriteSlopes(const Features& f, const Sums& error, int i,
                                double* const (&slope)[4]) {
  const double along = f.d[0] * error.by[0] + f.d[1] * error.by[1] + f.d[2] * error.by[2];
  for (int k = 0; k < 3; ++k) slope[k][i] = (error.by[k] - along * f.d[k]) * f.per_speed;
  slope[3][i] = error.by[3] * f.per_load;
}

template <bool kSlopes>
GROUSER_INLINE void EvaluateAll(const Frequencies& w, const Block& block) {
  Features f;
  for (int i = 0; i < block.count; ++i) {
    const Member* member = block.member[i];
    if (member != nullptr) Fill(w, block, i, kSlopes, &f);
    for (int o = 0; o < kOutputs; ++o) {
      if (block.error[o] == nullptr) continue;
      const Sums error =
          member != nullptr ? ErrorOf(w, f, *member, o, kSlopes) : Sums{0, {0, 0, 0, 0}};
      block.error[o][i] = error.value;
      if (!kSlopes || block.slope[o][0] == nullptr) continue;
      if (member != nullptr) {
        WriteSlopes(f, error, i, block.slope[o]);
      } else {
        for (double* slope : block.slope[o]) slope[i] = 0;
      }
    }
  }
}

}  // namespace

void Evaluate(const Frequencies& frequencies, const Block& block) noexcept {
  bool slopes = false;
  for (const auto& slope : block.slope) slopes |= slope[0] != nullptr;
  if (slopes) {
    EvaluateAll<true>(frequencies, block);
  } else {
    EvaluateAll<false>(frequencies, block);
  }
}

}  // namespace grouser::surrogate::draws::GROUSER_ISA_NS
