#pragma once

namespace grouser::surrogate {

/// Accepted counts of a binomial(n, p): the central interval of at least 95 %
/// (each tail at most 2.5 %).
struct Band {
  int low, high;
  bool Has(int count) const { return count >= low && count <= high; }
};
Band BinomialBand(int n, double p);

}  // namespace grouser::surrogate
