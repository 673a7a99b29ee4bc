#include "dem_offline/engine/experiment/mixing.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace grouser::dem::experiment {

double MeasureMixing(const std::vector<GrainState>& grains, const Probe& p) {
  const Region& r = p.region;
  std::vector<double> fine(static_cast<std::size_t>(p.n[0]) * p.n[1] * p.n[2]), all(fine.size());
  for (const GrainState& g : grains) {
    const double at[3] = {g.x_m, g.y_m, g.z_m};
    std::size_t bin = 0;
    bool in = true;
    for (int k = 0; k < 3; ++k) {
      const double share = (at[k] - r.low_m[k]) / (r.high_m[k] - r.low_m[k]);
      in = in && share >= 0 && share < 1;
      if (in) bin = bin * p.n[k] + static_cast<std::size_t>(share * p.n[k]);
    }
    if (!in) continue;
    const double volume = g.radius_m * g.radius_m * g.radius_m;
    all[bin] += volume;
    if (2 * g.radius_m < p.diameter_m) fine[bin] += volume;
  }
  double sum = 0, sum_fine = 0, squares = 0;
  for (std::size_t k = 0; k < all.size(); ++k) {
    sum += all[k];
    sum_fine += fine[k];
  }
  const double mean = sum_fine / sum;
  if (!(mean > 0 && mean < 1)) return std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (all[k] > 0) squares += all[k] * std::pow(fine[k] / all[k] - mean, 2);
  }
  return 1 - squares / sum / (mean * (1 - mean));
}

void CheckMixing(const std::string& at, const Probe& p) {
  if (p.region.radius_m > 0) {
    throw SpecError(at + ".region.radius_m", "a round region of mixing", "low_m and high_m alone");
  }
  CheckPositive(at + ".diameter_m", p.diameter_m);
  CheckWithin(at + ".n", 1.0 * p.n[0] * p.n[1] * p.n[2], 2, 1e6);
}

}  // namespace grouser::dem::experiment
