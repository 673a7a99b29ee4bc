#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "grouser/model.h"

namespace grouser {

inline constexpr char kSmall[] = GROUSER_SMALL_MODEL;
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kUntouched = -12345.0;
inline constexpr std::size_t kFields = 9;  // of OutputSpans, that the evaluator's view has too

// Storage of n states and of all their answers.
struct Batch {
  std::array<std::vector<double>, 4> in;  // v_x, v_y, rim speed, load
  std::array<std::array<std::vector<double>, kFields>, kOutputs> out;
  std::array<std::vector<double>, 2> echo;
  std::vector<std::uint32_t> flags;

  explicit Batch(std::size_t n) : flags(n, 77u) {
    for (auto& x : in) x.resize(n);
    for (auto& output : out) output.fill(std::vector<double>(n, kUntouched));
    echo.fill(std::vector<double>(n, kUntouched));
  }
  States states() const { return {in[0], in[1], in[2], in[3]}; }
  // Works for our spans and for the evaluator's: both have the same fields.
  template <typename View>
  View Into() {
    View view;
    for (std::size_t o = 0; o < kOutputs; ++o) {
      auto& f = out[o];
      auto& to = view.output[o];
      to.value = f[0], to.sd_fit = f[1], to.sd_patch = f[2], to.low = f[3], to.high = f[4];
      to.d_v_x = f[5], to.d_v_y = f[6], to.d_rim_speed = f[7], to.d_load = f[8];
    }
    view.flags = flags;
    view.slip = echo[0];
    view.attack_angle = echo[1];
    return view;
  }
  Answers answers() { return Into<Answers>(); }
  bool Untouched() const {
    bool same = true;
    for (const auto& output : out) {
      for (const auto& field : output) {
        for (const double x : field) same &= x == kUntouched;
      }
    }
    for (const std::uint32_t f : flags) same &= f == 77u;
    return same;
  }
};

inline bool SameBits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0);
}

// Driven, braked and sideways wheels, the last three of them bad or at rest.
inline Batch MakeBatch(std::size_t n) {
  Batch batch(n);
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> speed(-0.2, 0.2), load(8, 45);
  for (std::size_t i = 0; i < n; ++i) {
    for (int k = 0; k < 3; ++k) batch.in[k][i] = speed(random);
    batch.in[3][i] = load(random);
  }
  batch.in[0][n - 1] = kNaN;
  batch.in[3][n - 2] = -1;
  for (int k = 0; k < 3; ++k) batch.in[k][n - 3] = 0;
  return batch;
}

}  // namespace grouser
