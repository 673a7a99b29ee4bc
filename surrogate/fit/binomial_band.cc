#include "surrogate/fit/binomial_band.h"

#include <boost/math/distributions/binomial.hpp>

namespace grouser::surrogate {

Band BinomialBand(int n, double p) {
  const boost::math::binomial_distribution<double> law(n, p);
  Band band{0, n};
  while (band.low < n && boost::math::cdf(law, band.low) <= 0.025) ++band.low;
  while (band.high > 0 && boost::math::cdf(boost::math::complement(law, band.high - 1)) <= 0.025) {
    --band.high;
  }
  return band;
}

}  // namespace grouser::surrogate
