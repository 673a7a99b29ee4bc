// How beds are packed to a solid fraction, in one layer and in two, and where their surface is.
#include "dem_offline/engine/rig/packing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "dem_offline/engine/rig/preparation.h"
#include "tests/unit/engine/rig_testing.h"

namespace grouser::dem {
namespace {

using ::testing::HasSubstr;

/// Solid fraction that frictions would give, as beds answer: 0.56 at most with friction alone.
double Answer(const GrainFriction& f) {
  return 0.58 - 0.012 * std::log(f.friction / 0.5) -
         0.015 * std::log(std::max(f.rolling_friction, 1e-3) / 0.2);
}

struct Search {
  double solid_fraction = 0;
  GrainFriction friction;
  int tries = 0;
};
Search Find(const BedPreparation& given, double aim, bool rolls = true) {
  PackingSearch search(given, {0.5, 0.2}, rolls, 1.0);
  Search out;
  for (bool more = true; more; ++out.tries) {
    out.friction = search.next();
    out.solid_fraction = Answer(out.friction);
    more = search.Tried(out.solid_fraction - aim);
  }
  return out;
}

TEST(PackingSearch, FrictionComesFirstAndRollingFrictionWhereItIsNotEnough) {
  const Search dense = Find({}, 0.59);
  EXPECT_NEAR(dense.solid_fraction, 0.59, kFractionTolerance);
  EXPECT_EQ(dense.friction.rolling_friction, 0.2);  // the grains' own
  const Search loose = Find({}, 0.533);
  EXPECT_NEAR(loose.solid_fraction, 0.533, kFractionTolerance);
  EXPECT_EQ(loose.friction.friction, kMostFriction);
  EXPECT_GT(loose.friction.rolling_friction, 0.4);
  EXPECT_LE(loose.tries, PackingSearch::kMostAttempts);
}

TEST(PackingSearch, GoesOnFromWhatWasTriedForALowerAim) {
  PackingSearch search({}, {0.5, 0.2}, true, 1.0);
  const double aim = 0.575;
  while (search.Tried(Answer(search.next()) - aim)) {
  }
  search.AimLower(0.006);
  EXPECT_NEAR(Answer(search.next()), aim - 0.006, 1e-3);  // at once
}

TEST(PackingSearch, KeepsWhatIsGiven) {
  BedPreparation rolling;
  rolling.rolling_friction = 1.0;
  const Search by_friction = Find(rolling, 0.56);
  EXPECT_NEAR(by_friction.solid_fraction, 0.56, kFractionTolerance);
  EXPECT_EQ(by_friction.friction.rolling_friction, 1.0);
  BedPreparation friction;
  friction.friction = 0.7;
  const Search by_rolling = Find(friction, 0.56);
  EXPECT_NEAR(by_rolling.solid_fraction, 0.56, kFractionTolerance);
  EXPECT_EQ(by_rolling.friction.friction, 0.7);
  BedPreparation both = friction;
  both.rolling_friction = 0.2;
  EXPECT_EQ(Find(both, 0.5).tries, 1);
  EXPECT_GT(Find({}, 0.5, /*rolls=*/false).solid_fraction,
            0.55);  // the law has no rolling friction
}

BedSpec Bed(double solid_fraction) {
  BedSpec bed = BedOf(Small());
  bed.soil.friction = 0.55;
  bed.soil.rolling_friction = 0.3;
  bed.soil.solid_fraction = solid_fraction;
  return bed;
}

/// What a bed is refused with; empty: it is made.
std::string Refusal(const BedSpec& bed) {
  try {
    PrepareBed(bed, nullptr);
    return "";
  } catch (const SpecError& error) {
    EXPECT_EQ(error.field(), "soil.grains.solid_fraction");
    return error.expected();
  }
}

// Friction alone packs it to 0.55, which the bed then had without a word.
TEST(PrepareBed, MakesALooseBedOrSaysHowNearItCame) {
  BedSpec bed = Bed(0.541);
  const Tile tile = PrepareBed(bed, nullptr);
  EXPECT_NEAR(tile.solid_fraction, 0.541, kFractionTolerance);
  EXPECT_GT(tile.preparation_rolling_friction[0], 0.4);
  bed.soil.preparation.rolling_friction = 0.3;
  EXPECT_THAT(Refusal(bed), HasSubstr("reaches within 0.004; the nearest was 0.55"));
  bed = Bed(0.40);
  EXPECT_THAT(Refusal(bed), HasSubstr("the nearest was 0.5"));
}

TEST(PrepareBed, TakesTheFrictionsThatAreGiven) {
  BedSpec bed = Bed(0.58);
  bed.soil.preparation = {0.1, 0.05};
  double reached = 0;
  try {
    reached = PrepareBed(bed, nullptr).solid_fraction;
  } catch (const SpecError& error) {
    reached = std::stod(error.expected().substr(error.expected().rfind(' ')));
  }
  bed.soil.solid_fraction = reached;
  const Tile tile = PrepareBed(bed, nullptr);
  EXPECT_EQ(tile.preparation_friction[0], 0.1);
  EXPECT_EQ(tile.preparation_rolling_friction[0], 0.05);
  EXPECT_GT(reached, 0.59);  // slippery grains pack densely
}

/// Solid volume of a tile above a height over its area [m].
double SolidAbove(const Tile& t, double z0) {
  double solid = 0;
  for (std::size_t i = 0; i < t.radius_m.size(); ++i) {
    const double r = t.radius_m[i], z = t.position[3 * i + 2] / 4294967296.0 * TileZSpan(t.depth_m);
    const double h = std::clamp(z + r - z0, 0.0, 2 * r);  // of the cap above
    solid += M_PI * h * h * (r - h / 3);
  }
  return solid / (t.length_m * t.width_m);
}

TEST(PrepareBed, SurfaceIsThePlaneOfEqualMass) {
  const Tile& t = SmallTile();
  const double middle = -0.5 * t.depth_m, grain = 0.012;
  EXPECT_LT(t.surface_m, 0);
  EXPECT_GT(t.surface_m, -grain);
  // A continuum up to there holds what the grains do.
  const double solid = SolidAbove(t, -grain);
  EXPECT_NEAR(solid, t.solid_fraction * (t.surface_m + grain), 1e-3 * solid);
  EXPECT_NEAR(SolidAbove(t, middle), t.solid_fraction * (t.surface_m - middle), 0.05 * grain);
}

TEST(PrepareBed, ALooseLayerOnADenseBed) {
  BedSpec bed = Bed(0.60);
  bed.depth_m = 0.10;
  bed.soil.top = {0.045, 0.545, {}};
  const Tile t = PrepareBed(bed, nullptr);
  EXPECT_NEAR(t.solid_fraction, 0.60, kFractionTolerance);
  EXPECT_NEAR(t.top_solid_fraction, 0.545, kFractionTolerance);
  EXPECT_GT(t.preparation_friction[1], t.preparation_friction[0]);
  const double grain = 0.012;  // measured anew, without the layers at the ends
  const auto between = [&](double low, double high) {
    return (SolidAbove(t, low) - SolidAbove(t, high)) / (high - low);
  };
  EXPECT_NEAR(between(-0.045 + grain, -grain), t.top_solid_fraction, 1e-4);
  EXPECT_NEAR(between(-0.10 + grain, -0.045 - grain), t.solid_fraction, 1e-4);
  // With the frictions that were found the same bed comes again, and nothing is searched.
  bed.soil.preparation = {t.preparation_friction[0], t.preparation_rolling_friction[0]};
  bed.soil.top.preparation = {t.preparation_friction[1], t.preparation_rolling_friction[1]};
  EXPECT_EQ(PrepareBed(bed, nullptr).position, t.position);
}

TEST(ValidateBed, RefusesTopLayersWithoutASolidFraction) {
  const auto complaint = [](double thickness_m, double solid_fraction) -> std::string {
    BedSpec bed = Bed(0.58);
    bed.depth_m = 0.10;
    bed.soil.top = {thickness_m, solid_fraction, {}};
    try {
      ValidateBed(bed);
      return "";
    } catch (const SpecError& error) {
      return error.what();
    }
  };
  EXPECT_EQ(complaint(0.05, 0.54), "");
  EXPECT_THAT(complaint(0.02, 0.54),
              HasSubstr("top_layer.thickness_m: 0.02 m, expected at least 0.036 m"));
  EXPECT_THAT(complaint(0.09, 0.54),
              HasSubstr("top_layer.thickness_m: 0.09 m, expected at most 0.064 m"));
  EXPECT_THAT(complaint(0.05, 0.1), HasSubstr("top_layer.solid_fraction: 0.1"));
}

}  // namespace
}  // namespace grouser::dem
