// Parts of bodies against sampled surfaces.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "dem_offline/engine/bodies/part_distance.h"
#include "tests/unit/engine/bodies_testing.h"

namespace grouser::dem {
namespace {

/// A part in its own frame, told apart from the code under test: what is
/// solid, and a grid of points on its surface.
struct Oracle {
  Part part;
  std::function<bool(double, double, double)> solid;  ///< null: thin
  std::vector<Vec3f> surface;
};

using Curve = std::vector<std::pair<double, double>>;  ///< (rho, y) or (x, z)

void Line(double u0, double v0, double u1, double v1, double step, Curve* curve) {
  const int n = 1 + static_cast<int>(std::hypot(u1 - u0, v1 - v0) / step);
  for (int i = 0; i <= n; ++i) {
    curve->emplace_back(u0 + (u1 - u0) * i / n, v0 + (v1 - v0) * i / n);
  }
}

/// Points of the surface of revolution about y (about z if `flat`).
std::vector<Vec3f> Revolve(const Curve& curve, double step, bool flat) {
  std::vector<Vec3f> points;
  for (const auto& [rho, h] : curve) {
    const int n = 1 + static_cast<int>(2 * kPi * rho / step);
    for (int i = 0; i < n; ++i) {
      const float u = static_cast<float>(rho * std::cos(2 * kPi * i / n));
      const float v = static_cast<float>(rho * std::sin(2 * kPi * i / n));
      const float w = static_cast<float>(h);
      points.push_back(flat ? Vec3f{u, v, w} : Vec3f{u, w, v});
    }
  }
  return points;
}

constexpr double kStep = 0.01;

Oracle OfCylinder() {
  Oracle o;
  o.part.kind = PartKind::kCylinder;
  o.part.a = 0.5f, o.part.b = 0.3f;
  o.solid = [](double x, double y, double z) { return x * x + z * z < 0.25 && std::abs(y) < 0.3; };
  Curve c;
  Line(0, -0.3, 0.5, -0.3, kStep, &c);
  Line(0.5, -0.3, 0.5, 0.3, kStep, &c);
  Line(0.5, 0.3, 0, 0.3, kStep, &c);
  o.surface = Revolve(c, kStep, false);
  return o;
}

Oracle OfTube() {
  Oracle o;
  o.part.kind = PartKind::kHollowCylinder;
  o.part.a = 0.4f, o.part.b = 0.3f, o.part.c = 0.2f;
  o.solid = [](double x, double y, double z) {
    const double rho = std::hypot(x, z);
    return rho > 0.4 && rho < 0.6 && std::abs(y) < 0.3;
  };
  Curve c;
  Line(0.4, -0.3, 0.6, -0.3, kStep, &c);
  Line(0.6, -0.3, 0.6, 0.3, kStep, &c);
  Line(0.6, 0.3, 0.4, 0.3, kStep, &c);
  Line(0.4, 0.3, 0.4, -0.3, kStep, &c);
  o.surface = Revolve(c, kStep, false);
  return o;
}

Oracle OfBore() {
  Oracle o;
  o.part.kind = PartKind::kHollowCylinder;
  o.part.a = 0.4f, o.part.b = 0.3f;
  o.solid = [](double x, double y, double z) {
    return std::hypot(x, z) > 0.4 && std::abs(y) < 0.3;
  };
  Curve c;
  Line(1.8, -0.3, 0.4, -0.3, kStep, &c);
  Line(0.4, -0.3, 0.4, 0.3, kStep, &c);
  Line(0.4, 0.3, 1.8, 0.3, kStep, &c);
  o.surface = Revolve(c, kStep, false);
  return o;
}

Oracle OfDisc() {
  Oracle o;
  o.part.kind = PartKind::kDisc;
  o.part.a = 0.5f;
  Curve c;
  Line(0, 0, 0.5, 0, kStep, &c);
  o.surface = Revolve(c, kStep, true);
  return o;
}

Oracle OfAnnulus() {
  Oracle o;
  o.part.kind = PartKind::kAnnulus;
  o.part.a = 0.3f, o.part.b = 0.6f;
  Curve c;
  Line(0.3, 0, 0.6, 0, kStep, &c);
  o.surface = Revolve(c, kStep, true);
  return o;
}

/// Convex outline in (x, z) drawn out along y from -b to b.
void DrawOut(const Curve& corners, double b, std::vector<Vec3f>* surface) {
  Curve outline;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto& [u, v] = corners[i];
    const auto& [s, t] = corners[(i + 1) % corners.size()];
    Line(u, v, s, t, kStep, &outline);
  }
  const int n = static_cast<int>(2 * b / kStep);
  for (const auto& [x, z] : outline) {
    for (int i = 0; i <= n; ++i) {
      surface->push_back(
          {static_cast<float>(x), static_cast<float>(-b + 2 * b * i / n), static_cast<float>(z)});
    }
    for (int i = 0; i <= 40; ++i) {  // end faces: outline shrunk to its middle
      const float f = static_cast<float>(i) / 40;
      for (const double end : {-b, b}) {
        surface->push_back({f * static_cast<float>(x), static_cast<float>(end),
                            0.15f + f * (static_cast<float>(z) - 0.15f)});
      }
    }
  }
}

Oracle OfPrism(double root, double tip) {
  Oracle o;
  o.part.kind = PartKind::kPrism;
  o.part.a = static_cast<float>(root), o.part.b = 0.3f;
  o.part.c = 0.3f, o.part.d = static_cast<float>(tip);
  o.solid = [=](double x, double y, double z) {
    return z > 0 && z < 0.3 && std::abs(y) < 0.3 && std::abs(x) < root + (tip - root) * z / 0.3;
  };
  DrawOut({{-root, 0}, {root, 0}, {tip, 0.3}, {-tip, 0.3}}, 0.3, &o.surface);
  return o;
}

Oracle OfBox() {
  Oracle o = OfPrism(0.2, 0.2);
  o.part = Part();
  o.part.kind = PartKind::kBox;
  o.part.a = 0.2f, o.part.b = 0.3f, o.part.c = 0.15f;
  for (Vec3f& p : o.surface) p.z -= 0.15f;
  o.solid = [](double x, double y, double z) {
    return std::abs(x) < 0.2 && std::abs(y) < 0.3 && std::abs(z) < 0.15;
  };
  return o;
}

/// |distance| is that of the nearest of many surface points (which lie up to a
/// grid step off), the sign tells solid, p - distance x normal is on the
/// surface, and turning and moving the part turns and moves the answer.
void Verify(const Oracle& o, unsigned seed) {
  Random random(seed);
  Part moved = o.part;
  random.Turn(&moved);
  moved.centre[0] = 0.3f, moved.centre[1] = -0.2f, moved.centre[2] = 0.1f;
  int solid = 0;
  for (int k = 0; k < 400; ++k) {
    const Vec3f p = random.Point(k % 2 ? 0.8 : 0.35);
    const SignedDistance s = part_distance::ToPart(o.part, p);
    double nearest = 1e9;
    for (const Vec3f& q : o.surface) nearest = std::min<double>(nearest, Length(p - q));
    ASSERT_LE(std::abs(s.distance), nearest + 1e-6);
    // The foot has a grid point within 0.7 steps.
    ASSERT_GE(std::abs(s.distance) + 0.8 * kStep, nearest);
    if (o.solid) {
      ASSERT_EQ(s.distance < 0, o.solid(p.x, p.y, p.z)) << p.x << " " << p.y << " " << p.z;
      solid += s.distance < 0;
    } else {
      ASSERT_GE(s.distance, 0);
    }
    ASSERT_NEAR(Length(s.normal), 1, 1e-6);
    const Vec3f foot = p - s.distance * s.normal;
    ASSERT_NEAR(part_distance::ToPart(o.part, foot).distance, 0, 2e-7);
    const float* m = moved.axes;
    const Vec3f q = {moved.centre[0] + m[0] * p.x + m[3] * p.y + m[6] * p.z,
                     moved.centre[1] + m[1] * p.x + m[4] * p.y + m[7] * p.z,
                     moved.centre[2] + m[2] * p.x + m[5] * p.y + m[8] * p.z};
    ASSERT_NEAR(part_distance::ToPart(moved, q).distance, s.distance, 1e-6);
  }
  if (o.solid) {
    EXPECT_GT(solid, 20);
  }
}

TEST(PartDistance, Cylinder) { Verify(OfCylinder(), 1); }
TEST(PartDistance, Tube) { Verify(OfTube(), 2); }
TEST(PartDistance, Bore) { Verify(OfBore(), 3); }
TEST(PartDistance, Disc) { Verify(OfDisc(), 4); }
TEST(PartDistance, Annulus) { Verify(OfAnnulus(), 5); }
TEST(PartDistance, Box) { Verify(OfBox(), 6); }
TEST(PartDistance, Tooth) { Verify(OfPrism(0.25, 0.1), 7); }
TEST(PartDistance, StraightTooth) { Verify(OfPrism(0.2, 0.2), 8); }
TEST(PartDistance, UndercutTooth) { Verify(OfPrism(0.1, 0.25), 9); }
TEST(PartDistance, PointedTooth) { Verify(OfPrism(0.2, 0.0), 10); }

TEST(PartDistance, HalfSpaceIsThePlane) {
  const double n[3] = {1, 2, -2};
  const Shape shape = HalfSpace(n);
  const SignedDistance s = part_distance::ToPart(shape.parts[0], {3, 0, 0});
  EXPECT_FLOAT_EQ(s.distance, 1);
  EXPECT_FLOAT_EQ(s.normal.y, 2.0f / 3);
  EXPECT_LT(part_distance::ToPart(shape.parts[0], {0, -1, 1}).distance, 0);
}

}  // namespace
}  // namespace grouser::dem
