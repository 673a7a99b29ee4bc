#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "surrogate/calibrate/soil_fit.h"
#include "tests/unit/surrogate/calibrate_testing.h"

namespace grouser::surrogate {
namespace {

using testing::Measuring;
using testing::PlatesAndShear;

// Plates, shear and wheels on one soil, with the wheel's own parameters drawn anew from their
// priors: 100 seeds, and whether the soil's six lie in the 90 % region of each fit.
int TrialsInside(bool wheels, bool stated) {
  const Soil soil = testing::PublishedSoil("Ding 2011 simulant");
  const BekkerParameters truth = FromSoil(soil);
  const Typical known = testing::Known();
  int inside = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    Measuring measuring(truth, soil.kind, 0.05, seed);
    PlatesAndShear(&measuring);
    if (wheels) {
      measuring.Wheel({0.15, 0.1}, 80, {-0.4, 0.1, 0.4}, 0);
      measuring.Wheel({0.15, 0.1}, 80, {-0.2, 0.2}, 0.5);
    }
    const SoilLaw law(measuring.soil(), known, kBekkerForm);
    Coordinates x = law.CoordinatesOf(truth);
    for (const int c : law.free()) {
      const Prior& prior = law.priors()[c];
      if (c < kSoilCoordinates) continue;
      x[c] = std::clamp(prior.center + prior.sd * measuring.Normal(), prior.low, prior.high);
    }
    measuring.MeasureAt(law, x);
    for (Observation& at : measuring.soil().observations) {
      if (!stated) at.sd = std::nan("");
    }
    const SoilFit fit = FitSoil(measuring.soil(), known, kBekkerForm);
    inside += DistanceOf(fit, truth) <= RegionOf(fit) ? 1 : 0;
  }
  return inside;
}

TEST(CalibrateCoverage, TheTruthLiesInThe90PercentRegionAsOftenAsItSays) {
  struct Trial {
    bool wheels, stated;
  };
  for (const auto [wheels, stated] : {Trial{false, true}, Trial{false, false}, Trial{true, true}}) {
    const int inside = TrialsInside(wheels, stated);
    std::printf("%s, sd %s: %d of 100 inside\n", wheels ? "plates, shear, wheels" : "plates, shear",
                stated ? "stated" : "unstated", inside);
    EXPECT_GE(inside, 85) << wheels << stated;
    EXPECT_LE(inside, 95) << wheels << stated;
  }
}

}  // namespace
}  // namespace grouser::surrogate
