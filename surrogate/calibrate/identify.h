#pragma once

#include <string>
#include <vector>

#include "surrogate/calibrate/soil_fit.h"

namespace grouser::surrogate {

/// A combination of coordinates that the data leave uncertain: an eigenvector of the posterior
/// covariance in units of the priors' sds.
struct Direction {
  double share_left;             ///< of the prior's uncertainty, > kIdentified
  std::vector<int> coordinates;  ///< with a loading of at least 0.4, largest first
  std::vector<double> loadings;
  std::string text;  ///< "plates of one width (30 mm) cannot tell ...; ... would"
};

/// A test that was not made, and what it would tell (Fisher information added at the fit).
struct NextTest {
  std::string text;      ///< "a plate of radius or width 60 mm"
  double share_left;     ///< of the most uncertain direction of the soil's six, after it
  double interval_left;  ///< of the parameter that gains most: its sd after over before
  std::string gains;     ///< name of that parameter
};

/// The directions that are not identified, the most uncertain first; those of the soil's own
/// six coordinates before the wheel's.
std::vector<Direction> UnidentifiedDirections(const SoilFit& fit);
/// Candidates, the most telling first: another plate, a deeper one, shear at other pressures,
/// driven, braked and skewed wheels where there is a wheel. Each as its rows would be with 5 % of
/// noise (wheels: 4 % of load and radius).
std::vector<NextTest> NextTests(const SoilFit& fit);

}  // namespace grouser::surrogate
