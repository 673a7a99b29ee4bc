#pragma once

#include <cstdint>

namespace grouser::dem {

/// SplitMix64: the same numbers on every machine (the distributions of std:: are not).
class Random {
 public:
  explicit Random(std::uint64_t state) : state_(state) {}
  double Uniform() {  ///< [0, 1)
    state_ += 0x9e3779b97f4a7c15ull;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-53;
  }
  double Between(double low, double high) { return low + (high - low) * Uniform(); }

 private:
  std::uint64_t state_;
};

}  // namespace grouser::dem
