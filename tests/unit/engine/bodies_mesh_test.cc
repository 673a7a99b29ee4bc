// Meshes against planes, boxes and brute force.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/bodies/mesh.h"
#include "dem_offline/engine/bodies/part_distance.h"
#include "tests/unit/engine/bodies_testing.h"

namespace grouser::dem {
namespace {

using Vec = std::array<double, 3>;

Vec Sub(const Vec& a, const Vec& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double DotOf(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Nearest distance by a route of its own: minimise |p - a - u ab - v ac| over
/// the triangle by projecting on its plane, then on its three sides.
double Brute(const TriangleSoup& s, const Vec& p) {
  double least = 1e300;
  for (const auto& t : s.triangles) {
    const Vec &a = s.vertices[t[0]], &b = s.vertices[t[1]], &c = s.vertices[t[2]];
    const Vec e = Sub(b, a), f = Sub(c, a), w = Sub(p, a);
    const double ee = DotOf(e, e), ef = DotOf(e, f), ff = DotOf(f, f), we = DotOf(w, e),
                 wf = DotOf(w, f), det = ee * ff - ef * ef;
    const double u = (ff * we - ef * wf) / det, v = (ee * wf - ef * we) / det;
    if (u >= 0 && v >= 0 && u + v <= 1) {
      least = std::min(least, std::sqrt(std::max(0.0, DotOf(w, w) - u * we - v * wf)));
    }
    for (const auto& [g, h] : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}}) {
      const Vec d = Sub(h, g), r = Sub(p, g);
      const double x = std::min(1.0, std::max(0.0, DotOf(r, d) / DotOf(d, d)));
      const Vec q = {r[0] - x * d[0], r[1] - x * d[1], r[2] - x * d[2]};
      least = std::min(least, std::sqrt(DotOf(q, q)));
    }
  }
  return least;
}

/// Inside by the solid angle that all triangles fill as seen from p
/// (van Oosterom & Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125).
bool Inside(const TriangleSoup& s, const Vec& p) {
  double sum = 0;
  for (const auto& t : s.triangles) {
    const Vec a = Sub(s.vertices[t[0]], p), b = Sub(s.vertices[t[1]], p),
              c = Sub(s.vertices[t[2]], p);
    const double la = std::sqrt(DotOf(a, a)), lb = std::sqrt(DotOf(b, b)),
                 lc = std::sqrt(DotOf(c, c));
    const double det = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
                       a[2] * (b[0] * c[1] - b[1] * c[0]);
    sum +=
        2 * std::atan2(det, la * lb * lc + DotOf(a, b) * lc + DotOf(b, c) * la + DotOf(c, a) * lb);
  }
  return sum > 2 * kPi;
}

TEST(Mesh, AFlatPlateIsAPlane) {
  const Mesh mesh(Plate(9, [](double x, double y) { return 0.3 * x - 0.2 * y; }));
  EXPECT_EQ(mesh.surfaces(), 1);
  EXPECT_FALSE(mesh.closed());
  const double length = std::sqrt(1 + 0.09 + 0.04);
  Random random(1);
  for (int k = 0; k < 20000; ++k) {
    const float x = random.In(-0.7, 0.7), y = random.In(-0.7, 0.7), z = random.In(-0.2, 0.2);
    SurfacePoint out[kMostSurfacePoints];
    const double plane = (z - 0.3 * x + 0.2 * y) / length;
    const int n = mesh.Nearest({x, y, z}, 0.25f, out, kMostSurfacePoints);
    ASSERT_EQ(n, std::abs(plane) < 0.25 ? 1 : 0);
    if (n == 0) continue;
    ASSERT_FLOAT_EQ(out[0].distance, static_cast<float>(std::abs(plane)));  // a sheet: two sides
    ASSERT_NEAR(out[0].normal.z, (plane > 0 ? 1 : -1) / length, 1e-7);
    ASSERT_EQ(out[0].key, kMeshKey);
  }
}

TEST(Mesh, ABoxIsABox) {  // one contact over faces, edges and corners; inside too
  const auto mesh = std::make_shared<const Mesh>(BoxSoup(0.2, 0.3, 0.15));
  EXPECT_EQ(mesh->surfaces(), 6);
  EXPECT_TRUE(mesh->closed());
  const Shape of_mesh = FromMesh(mesh), box = Box(0.4, 0.6, 0.3);
  EXPECT_NEAR(of_mesh.reach, box.reach, 1e-6);
  Random random(2);
  for (int k = 0; k < 20000; ++k) {
    const Vec3f p = random.Point(0.4);
    SurfacePoint m[kMostSurfacePoints], b[kMostSurfacePoints];
    const float reach = 0.12f;
    const int n = SurfacePoints(of_mesh, p, reach, m);
    const SignedDistance truth = part_distance::ToPart(box.parts[0], p);
    ASSERT_EQ(n, std::abs(truth.distance) < reach ? 1 : 0) << p.x << " " << p.y << " " << p.z;
    if (n == 0) continue;
    SurfacePoints(box, p, reach, b);
    ASSERT_NEAR(m[0].distance, b[0].distance, 1e-7);
    if (truth.distance > 1e-3f) {
      ASSERT_NEAR(Dot(m[0].normal, b[0].normal), 1, 1e-6);
    }
  }
}

TEST(Mesh, AnyShapeAgainstBruteForce) {
  const TriangleSoup soup =
      Torus(24, 15, 0.6, [](double b) { return 0.25 + 0.06 * std::cos(3 * b); });
  const Mesh smooth(soup, 3.0), faceted(soup, 0.0);
  EXPECT_TRUE(smooth.closed());
  EXPECT_EQ(smooth.surfaces(), 1);
  EXPECT_GT(faceted.surfaces(), 300);
  Random random(3);
  int inside = 0;
  for (int k = 0; k < 3000; ++k) {
    const Vec3f p = random.Point(1);
    const Vec q = {p.x, p.y, p.z};
    const double distance = Brute(soup, q);
    const bool in = Inside(soup, q);
    inside += in;
    for (const float reach : {0.15f, 3.0f}) {
      SurfacePoint out[kMostSurfacePoints];
      const int n = smooth.Nearest(p, reach, out, kMostSurfacePoints);
      ASSERT_EQ(n, distance < reach ? 1 : 0);
      if (n == 0) continue;
      ASSERT_NEAR(out[0].distance, in ? -distance : distance, 2e-7);
      const Vec3f foot = p - out[0].distance * out[0].normal;
      ASSERT_LT(Brute(soup, {foot.x, foot.y, foot.z}), 3e-7);
      // Facets as surfaces: their least distance is the same one.
      const int m = faceted.Nearest(p, 0.15f, out, kMostSurfacePoints);
      ASSERT_EQ(m > 0, distance < 0.15f);
      float least = 1;
      for (int i = 0; i < m; ++i) least = std::min(least, out[i].distance);
      if (m > 0) {
        ASSERT_NEAR(least, in ? -distance : distance, 2e-7);
      }
    }
    ASSERT_LE(smooth.LowerBound(p), distance + 1e-7);
  }
  EXPECT_GT(inside, 200);
}

/// Over convex facets, even where each is a surface of its own, a grain meets
/// one; over smooth ones it also keeps its key, hence its history.
TEST(Mesh, ConvexFacetsGiveOneContactWithoutJumps) {
  const TriangleSoup soup = Torus(20, 20, 0.8, [](double) { return 0.3; });
  const Mesh smooth(soup), faceted(soup, 0.01);
  float before = 0;
  for (int k = 0; k <= 5000; ++k) {
    const double a = 2 * kPi * k / 5000;
    const Vec3f p = {static_cast<float>(1.2 * std::cos(a)), 0.013f,
                     static_cast<float>(1.2 * std::sin(a))};
    SurfacePoint out[kMostSurfacePoints];
    ASSERT_EQ(faceted.Nearest(p, 0.16f, out, kMostSurfacePoints), 1) << a;
    ASSERT_EQ(smooth.Nearest(p, 0.16f, out, kMostSurfacePoints), 1);
    ASSERT_EQ(out[0].key, kMeshKey);
    if (k > 0) {
      ASSERT_LT(std::abs(out[0].distance - before), 2 * kPi * 1.2 / 5000);
    }
    before = out[0].distance;
  }
}

TEST(Mesh, ConcaveCornersGiveTwoAndThree) {
  TriangleSoup room = BoxSoup(1, 1, 1);
  for (auto& t : room.triangles) std::swap(t[1], t[2]);  // grains inside
  const Mesh mesh(room);
  SurfacePoint out[kMostSurfacePoints];
  EXPECT_EQ(mesh.Nearest({0, 0, -0.95f}, 0.1f, out, 6), 1);
  EXPECT_FLOAT_EQ(out[0].distance, 0.05f);
  EXPECT_FLOAT_EQ(out[0].normal.z, 1);
  EXPECT_EQ(mesh.Nearest({0.94f, 0, -0.95f}, 0.1f, out, 6), 2);
  EXPECT_EQ(mesh.Nearest({0.94f, -0.93f, -0.95f}, 0.1f, out, 6), 3);
  EXPECT_LT(out[0].key, out[1].key);
  EXPECT_LT(out[1].key, out[2].key);
  EXPECT_EQ(mesh.Nearest({0.94f, -0.93f, -0.95f}, 0.1f, out, 2), 2);
  EXPECT_EQ(mesh.Nearest({0, 0, -1.01f}, 0.1f, out, 6), 1);  // past the wall: pushed back
  EXPECT_NEAR(out[0].distance, -0.01f, 1e-7);
  EXPECT_FLOAT_EQ(out[0].normal.z, 1);
  EXPECT_EQ(mesh.Nearest({0, 0, 0}, 0.9f, out, 6), 0);
}

TEST(Mesh, AThinSolidShowsOnlyItsFront) {
  const Mesh mesh(BoxSoup(0.5, 0.5, 0.001));
  Random random(4);
  for (int k = 0; k < 5000; ++k) {
    const Vec3f p = {random.In(-0.6, 0.6), random.In(-0.6, 0.6), random.In(0.002, 0.05)};
    SurfacePoint out[kMostSurfacePoints];
    const int n = mesh.Nearest(p, 0.06f, out, kMostSurfacePoints);
    ASSERT_LE(n, 1);
    if (n == 1) {
      ASSERT_GT(out[0].distance, 0);
      ASSERT_GT(out[0].normal.z, 0);
    }
  }
}

TEST(Mesh, ASheetBentSharplyHoldsAGrainOnBothSides) {
  const Mesh mesh(Plate(8, [](double x, double) { return std::abs(x); }));  // a V
  EXPECT_EQ(mesh.surfaces(), 2);
  SurfacePoint out[kMostSurfacePoints];
  EXPECT_EQ(mesh.Nearest({0, 0.1f, 0.2f}, 0.15f, out, 6), 2);
  EXPECT_NEAR(out[0].distance, 0.2 * std::sqrt(0.5), 1e-7);
  EXPECT_EQ(mesh.Nearest({0, 0.1f, -0.1f}, 0.15f, out, 6), 1);  // below: the keel
  EXPECT_NEAR(out[0].distance, 0.1, 1e-7);
  EXPECT_NEAR(out[0].normal.z, -1, 1e-7);
  EXPECT_EQ(mesh.Nearest({0.02f, 0.1f, -0.1f}, 0.15f, out, 6), 1);
  EXPECT_EQ(mesh.Nearest({0, 1.1f, 0.0f}, 0.15f, out, 6), 1);  // beyond its end
  EXPECT_NEAR(out[0].distance, 0.1, 1e-7);
}

TEST(Mesh, SweptDistanceBoundsAMesh) {
  TriangleSoup soup = BoxSoup(0.2, 0.3, 0.15);
  for (auto& v : soup.vertices) v[0] += 0.1, v[1] -= 0.4;
  const Shape shape = FromMesh(std::make_shared<const Mesh>(soup));
  Random random(6);
  for (int k = 0; k < 3000; ++k) {
    const Vec3f p = random.Point(1);
    const double a = random.In(0, 2 * kPi), c = std::cos(a), s = std::sin(a);
    const Vec q = {c * p.x + s * p.z, p.y, -s * p.x + c * p.z};
    ASSERT_LE(SweptDistance(shape, p), Inside(soup, q) ? 0 : Brute(soup, q) + 1e-6);
  }
}

std::string ErrorOf(const TriangleSoup& soup, double angle = 0.5) {
  try {
    Mesh mesh(soup, angle);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Mesh, RefusesByFaceNumber) {
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(ErrorOf({}), "no triangle");
  has(ErrorOf(BoxSoup(1, 1, 1), -1), "smooth_angle_rad");
  TriangleSoup s = BoxSoup(1, 1, 1);
  s.vertices[3][1] = std::numeric_limits<double>::quiet_NaN();
  has(ErrorOf(s), "vertex 3");
  s = BoxSoup(1, 1, 1);
  s.triangles[7][2] = 8;
  has(ErrorOf(s), "face 7: got vertex 8");
  s.triangles[7][2] = -1;
  has(ErrorOf(s), "face 7: got vertex -1");
  s = BoxSoup(1, 1, 1);
  s.triangles[5][1] = s.triangles[5][0];
  has(ErrorOf(s), "face 5 is degenerate");
  s = BoxSoup(1, 1, 1);
  s.vertices.push_back({0, 0, 0});
  s.vertices.push_back({1, 1, 1});
  s.vertices.push_back({2, 2, 2});
  s.triangles.push_back({8, 9, 10});
  has(ErrorOf(s), "face 12 is degenerate");
  s = BoxSoup(1, 1, 1);
  s.vertices.push_back({0, 0, 3});
  s.triangles.push_back({0, 1, 8});
  has(ErrorOf(s), "face 12 is the third");
  s = BoxSoup(1, 1, 1);
  std::swap(s.triangles[4][0], s.triangles[4][1]);
  has(ErrorOf(s), "is wound against");
}

}  // namespace
}  // namespace grouser::dem
