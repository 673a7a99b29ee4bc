#pragma once

#include <cstdint>

namespace grouser::dem {

/// SplitMix64: the same numbers on every machine (std:: distributions are not).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t Next() {
    std::uint64_t z = (state_ += kStep);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }
  double Uniform() { return static_cast<double>(Next() >> 11) * 0x1.0p-53; }  ///< [0, 1)
  double Between(double low, double high) { return low + (high - low) * Uniform(); }

  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15ull;

 private:
  std::uint64_t state_;
};

/// Of a bed, by its number: small numbers give streams far from each other.
inline Random RandomOfSeed(std::uint64_t seed) { return Random(seed * Random::kStep + 1); }

}  // namespace grouser::dem
