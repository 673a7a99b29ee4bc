// Wheels and builders: treads, the union's contacts, lower bounds under turning.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "dem_offline/engine/bodies/part_distance.h"
#include "tests/unit/engine/bodies_testing.h"

namespace grouser::dem {
namespace {

/// The rim is exactly what the smooth wheel always was.
TEST(SmoothWheel, SameBitsAsTheFormula) {
  const Shape wheel = SmoothWheel(0.1, 0.08);
  EXPECT_TRUE(wheel.round);
  Random random(11);
  int rims = 0;
  for (int k = 0; k < 2000; ++k) {
    const Vec3f p = random.Point(0.12);
    const float rho = std::sqrt(p.x * p.x + p.z * p.z);
    const float dr = rho - 0.1f, dy = std::abs(p.y) - 0.04f;
    const float expected = dr > 0 && dy > 0 ? std::sqrt(dr * dr + dy * dy) : std::max(dr, dy);
    SurfacePoint out[kMostSurfacePoints];
    ASSERT_EQ(SurfacePoints(wheel, p, 1, out), 1);
    ASSERT_EQ(std::memcmp(&out[0].distance, &expected, 4), 0);
    ASSERT_EQ(out[0].rim, dr > dy && !(dy > 0));
    rims += out[0].rim;
  }
  EXPECT_GT(rims, 100);
}

Tread Bars(int count, double lean = 0) {
  Tread t;
  t.count = count;
  t.height_m = 0.015;
  t.root_thickness_m = 0.006;
  t.tip_thickness_m = 0.004;
  t.lean_rad = lean;
  return t;
}

TEST(TreadedWheel, BarsAreWhereTheyShouldBe) {
  const Shape wheel = TreadedWheel(0.1, 0.08, {Bars(12)});
  ASSERT_EQ(wheel.parts.size(), 13u);
  EXPECT_FALSE(wheel.round);
  for (int k = 0; k < 12; ++k) {
    const double a = 2 * kPi * k / 12;  // from +z towards +x
    const auto at = [&](double rho, double tangent) {
      return Vec3f{static_cast<float>(rho * std::sin(a) + tangent * std::cos(a)), 0.01f,
                   static_cast<float>(rho * std::cos(a) - tangent * std::sin(a))};
    };
    SurfacePoint out[kMostSurfacePoints];
    // Above the tip: one contact, the rim's hidden below it.
    ASSERT_EQ(SurfacePoints(wheel, at(0.119, 0), 0.03f, out), 1);
    EXPECT_EQ(out[0].key, k + 1);
    EXPECT_NEAR(out[0].distance, 0.004, 1e-7);
    EXPECT_FALSE(out[0].rim);
    // In the corner of rim and flank: both.
    ASSERT_EQ(SurfacePoints(wheel, at(0.105, 0.008), 0.007f, out), 2);
    EXPECT_EQ(out[0].key, 0);
    EXPECT_TRUE(out[0].rim);
    EXPECT_EQ(out[1].key, k + 1);
    // Beside the wheel, flush with the bar's end: one.
    Vec3f side = at(0.0995, 0);
    side.y = 0.045f;
    ASSERT_EQ(SurfacePoints(wheel, side, 0.01f, out), 1);
    EXPECT_EQ(out[0].key, 0);
    EXPECT_NEAR(out[0].distance, 0.005, 1e-7);
    side = at(0.105, 0);
    side.y = 0.045f;
    ASSERT_EQ(SurfacePoints(wheel, side, 0.012f, out), 1);
    EXPECT_EQ(out[0].key, k + 1);
  }
}

/// Under every bar, chevrons too, the union has no gap between foot and rim.
TEST(TreadedWheel, NoGapUnderTheBars) {
  for (const double lean : {0.0, 0.3, -0.6, 0.9}) {
    const Shape wheel = TreadedWheel(0.1, 0.08, {Bars(7, lean)});
    for (std::size_t k = 1; k < wheel.parts.size(); ++k) {
      const Part& bar = wheel.parts[k];
      for (int corner = 0; corner < 4; ++corner) {
        const float x = corner & 1 ? bar.a : -bar.a, y = corner & 2 ? bar.b : -bar.b;
        const Vec3f p = {bar.centre[0] + x * bar.axes[0] + y * bar.axes[3],
                         bar.centre[1] + x * bar.axes[1] + y * bar.axes[4],
                         bar.centre[2] + x * bar.axes[2] + y * bar.axes[5]};
        EXPECT_LT(part_distance::ToPart(wheel.parts[0], p).distance, 1e-7)
            << lean;  // foot within the rim
        EXPECT_LE(std::abs(p.y), 0.04 + 1e-7);
        EXPECT_LT(std::hypot(p.x, p.z), 0.0995);
      }
      const Vec3f middle = {bar.centre[0], bar.centre[1], bar.centre[2]};
      const float height = Length(middle) + bar.c;
      EXPECT_NEAR(height, 0.115, 1e-6);
    }
  }
}

/// The union's distance is the least of all parts'; a grain rolling around the
/// wheel meets one contact on smooth places, two in corners, and never two of
/// the same place.
TEST(TreadedWheel, NothingTwiceAndNothingMissed) {
  Tread left = Bars(9, 0.4), right = Bars(9, -0.4);
  left.width_m = right.width_m = 0.04;
  left.offset_m = 0.02, right.offset_m = -0.02, right.phase_rad = 0.2;
  const Shape wheel = TreadedWheel(0.1, 0.08, {left, right});
  Random random(12);
  int several = 0;
  for (int k = 0; k < 20000; ++k) {
    const Vec3f p = random.Point(0.13);
    const float reach = 0.012f;
    SurfacePoint out[kMostSurfacePoints];
    const int n = SurfacePoints(wheel, p, reach, out);
    float least = 1e9f;
    for (const Part& part : wheel.parts)
      least = std::min(least, part_distance::ToPart(part, p).distance);
    ASSERT_EQ(n > 0, least < reach);
    float got = 1e9f;
    for (int i = 0; i < n; ++i) {
      got = std::min(got, out[i].distance);
      if (i > 0) {
        ASSERT_GT(out[i].key, out[i - 1].key);
      }
      const Vec3f foot = p - out[i].distance * out[i].normal;
      for (int j = 0; j < i; ++j) {
        ASSERT_GT(Length(foot - (p - out[j].distance * out[j].normal)), 0.5e-4f * reach);
      }
    }
    if (n > 0) {
      ASSERT_LE(got, least + 1e-4f * reach);
    }
    several += n > 1;
  }
  EXPECT_GT(several, 50);
}

/// As the wheel turns under a resting grain, the nearest distance of the whole
/// never jumps.
TEST(TreadedWheel, DistanceIsContinuousAsItTurns) {
  const Shape wheel = TreadedWheel(0.1, 0.08, {Bars(16)});
  float before = -1;
  for (int k = 0; k <= 20000; ++k) {
    const double a = 2 * kPi * k / 20000;
    const Vec3f p = {static_cast<float>(0.112 * std::sin(a)), 0.0f,
                     static_cast<float>(0.112 * std::cos(a))};
    SurfacePoint out[kMostSurfacePoints];
    const int n = SurfacePoints(wheel, p, 0.02f, out);
    ASSERT_GE(n, 1);
    float least = out[0].distance;
    for (int i = 1; i < n; ++i) least = std::min(least, out[i].distance);
    if (k > 0) {
      ASSERT_LT(std::abs(least - before), 1.1 * 2 * kPi * 0.112 / 20000);
    }
    before = least;
  }
}

TEST(SweptDistance, IsALowerBoundUnderTurning) {
  Random random(13);
  const double tilted[3] = {0.2, 0.5, 0.9}, along[3] = {0, 1, 0};
  Shape pieces = SmoothWheel(0.2, 0.3);
  pieces.round = false;
  for (const PartKind kind : {PartKind::kCylinder, PartKind::kBox, PartKind::kPrism,
                              PartKind::kDisc, PartKind::kAnnulus, PartKind::kHollowCylinder}) {
    Part part;
    part.kind = kind;
    part.a = 0.1f, part.b = 0.2f, part.c = 0.15f, part.d = 0.05f;
    random.Turn(&part);
    const Vec3f c = random.Point(0.4);
    part.centre[0] = c.x, part.centre[1] = c.y, part.centre[2] = c.z;
    pieces.parts.push_back(part);
  }
  std::vector<Shape> shapes = {HalfSpace(tilted),
                               HalfSpace(along),
                               SmoothWheel(0.3, 0.2),
                               HollowCylinder(0.5, 0.4),
                               HollowCylinder(0.5, 0.4, 0.1),
                               Disc(0.4),
                               Annulus(0.2, 0.5),
                               Box(0.3, 0.5, 0.7),
                               TreadedWheel(0.3, 0.4, {Bars(20, 0.5)}),
                               pieces};
  for (const Part& part : pieces.parts) {
    Shape one;
    one.round = false;
    one.parts.push_back(part);
    shapes.push_back(one);
  }
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    for (int k = 0; k < 300; ++k) {
      const Vec3f p = random.Point(1);
      const float bound = SweptDistance(shapes[s], p);
      for (int t = 0; t < 40; ++t) {
        const double a = random.In(0, 2 * kPi), cosine = std::cos(a), sine = std::sin(a);
        const Vec3f q = {static_cast<float>(cosine * p.x + sine * p.z), p.y,
                         static_cast<float>(-sine * p.x + cosine * p.z)};
        const float there = StillDistance(shapes[s], q);
        ASSERT_LE(bound, there + 1e-6f) << "shape " << s;
        if (shapes[s].round) {
          ASSERT_NEAR(StillDistance(shapes[s], p), there, 1e-5);
        }
        SurfacePoint out[kMostSurfacePoints];
        const int n = SurfacePoints(shapes[s], q, 5, out);
        for (int i = 0; i < n; ++i) ASSERT_LE(there, out[i].distance + 1e-6f);
      }
    }
  }
}

TEST(SweptDistance, IsTightForWheels) {
  const Shape wheel = TreadedWheel(0.1, 0.08, {Bars(12)});
  EXPECT_NEAR(SweptDistance(wheel, {0.2f, 0, 0}), 0.2 - 0.115, 2e-5);
  EXPECT_GT(SweptDistance(wheel, {0, 0.05f, 0}), 0.0099);
  EXPECT_NEAR(SweptDistance(SmoothWheel(0.1, 0.08), {0, 0, 0.15f}), 0.05, 1e-6);
}

TEST(Builders, RefuseByFieldName) {
  const auto says = [](const std::function<void()>& make, const char* field) {
    try {
      make();
      ADD_FAILURE() << field;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
    }
  };
  says([] { SmoothWheel(-1, 1); }, "radius_m");
  says([] { SmoothWheel(1, NAN); }, "width_m");
  says([] { HollowCylinder(1, 0); }, "length_m");
  says([] { HollowCylinder(1, 1, -1); }, "wall_m");
  says([] { Annulus(1, 1); }, "outer_radius_m");
  says([] { Box(1, 1, INFINITY); }, "z_m");
  says(
      [] {
        const double n[3] = {0, 0, 0};
        HalfSpace(n);
      },
      "normal");
  says([] { FromMesh(nullptr); }, "mesh");
  Tread t = Bars(12);
  t.count = 0;
  says([&] { TreadedWheel(0.1, 0.08, {t}); }, "tread.count");
  t = Bars(12);
  t.width_m = 0.1;
  says([&] { TreadedWheel(0.1, 0.08, {t}); }, "tread.width_m");
  t = Bars(12);
  t.height_m = 0;
  says([&] { TreadedWheel(0.1, 0.08, {t}); }, "tread.height_m");
  t = Bars(120);
  says([&] { TreadedWheel(0.1, 0.08, {t}); }, "tread.root_thickness_m");
  t = Bars(2);
  t.root_thickness_m = 0.21;  // wider than the wheel's diameter
  says([&] { TreadedWheel(0.1, 0.08, {t}); }, "tread.root_thickness_m");
}

}  // namespace
}  // namespace grouser::dem
