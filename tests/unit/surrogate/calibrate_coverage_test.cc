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
// priors: so many seeds, and whether the soil's six lie in the 90 % region of each fit.
int TrialsInside(bool wheels, bool stated, unsigned seeds) {
  const Soil soil = testing::PublishedSoil("Ding 2011 simulant");
  const BekkerParameters truth = FromSoil(soil);
  const Typical known = testing::Known();
  int inside = 0;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
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

void ExpectInside(unsigned seeds, int least, int most) {
  struct Trial {
    bool wheels, stated;
  };
  for (const auto [wheels, stated] : {Trial{false, true}, Trial{false, false}, Trial{true, true}}) {
    const int inside = TrialsInside(wheels, stated, seeds);
    std::printf("%s, sd %s: %d of %u inside\n", wheels ? "plates, shear, wheels" : "plates, shear",
                stated ? "stated" : "unstated", inside, seeds);
    EXPECT_GE(inside, least) << wheels << stated;
    EXPECT_LE(inside, most) << wheels << stated;
  }
}

// (With --full.)
TEST(CalibrateCoverage, TheTruthLiesInThe90PercentRegionAsOftenAsItSays) {
  ExpectInside(100, 85, 95);
}

// Of 20 rightly stated regions fewer than 15 hold the truth with a probability of 1.1 %.
TEST(CalibrateCoverageQuick, TheTruthMostlyLiesInThe90PercentRegion) { ExpectInside(20, 15, 20); }

}  // namespace
}  // namespace grouser::surrogate
