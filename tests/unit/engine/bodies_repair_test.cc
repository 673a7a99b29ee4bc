// Meshes with the faults that files have, against the clean mesh.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/bodies/mesh_repair.h"
#include "dem_offline/engine/bodies/vertex_merge.h"
#include "tests/unit/engine/bodies_testing.h"

namespace grouser::dem {
namespace {

void Turn(std::array<std::int32_t, 3>* t) { std::swap((*t)[1], (*t)[2]); }
TriangleSoup Reversed(TriangleSoup s) {
  for (auto& t : s.triangles) Turn(&t);
  return s;
}
/// Both, the second moved; vertices at one place are one.
TriangleSoup Both(TriangleSoup a, const TriangleSoup& b, const Vec3d& by = {0, 0, 0}) {
  const auto first = static_cast<std::int32_t>(a.vertices.size());
  for (const Vec3d& v : b.vertices) a.vertices.push_back(Add(v, by));
  for (const auto& t : b.triangles) {
    a.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  MergeVertices(&a, "both");
  return a;
}

/// A wheel of a rim and grousers, as one solid about y.
TriangleSoup Wheel() {
  return Torus(48, 5, 0.5, [](double b) { return 0.2 + 0.02 * std::cos(5 * b); });
}

MeshReport Repaired(TriangleSoup* soup, SolidSide solid = SolidSide::kInside) {
  const MeshReport report = RepairMesh(soup, "m.stl", solid);
  (void)Mesh(*soup);  // takes it
  return report;
}
std::string Complaint(TriangleSoup soup) {
  try {
    RepairMesh(&soup, "m.stl");
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}
void ExpectHas(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text;
}

/// Every grain around both meets the same surfaces.
void ExpectSameContacts(const TriangleSoup& a, const TriangleSoup& b, double tolerance = 0) {
  const Mesh m(a), n(b);
  Random random(5);
  int met = 0;
  for (int k = 0; k < 4000; ++k) {
    const Vec3f p = random.Point(0.8);
    SurfacePoint x[kMostSurfacePoints], y[kMostSurfacePoints];
    const int count = m.Nearest(p, 0.1f, x, kMostSurfacePoints);
    ASSERT_EQ(n.Nearest(p, 0.1f, y, kMostSurfacePoints), count) << p.x << " " << p.y << " " << p.z;
    met += count;
    for (int i = 0; i < count; ++i) {
      ASSERT_NEAR(x[i].distance, y[i].distance, tolerance);
      ASSERT_NEAR(Length(x[i].normal - y[i].normal), 0, 100 * tolerance);
    }
  }
  EXPECT_GT(met, 100);
}

TEST(MeshRepair, ACleanMeshStaysToTheBit) {
  for (const TriangleSoup& clean :
       {BoxSoup(0.3, 0.2, 0.1), Wheel(), Plate(4, [](double x, double) { return 0.1 * x; })}) {
    TriangleSoup got = clean;
    const MeshReport report = Repaired(&got);
    EXPECT_FALSE(report.Changed()) << report.Words();
    EXPECT_EQ(got.vertices, clean.vertices);
    EXPECT_EQ(got.triangles, clean.triangles);
    ExpectHas(report.Words(), "nothing to repair");
  }
}

TEST(MeshRepair, TrianglesWithoutAreaAndCopiesAreDropped) {
  const TriangleSoup clean = Wheel();
  TriangleSoup got = clean;
  got.triangles.insert(got.triangles.begin() + 7, {3, 3, 9});
  got.triangles.push_back({4, 4, 4});
  got.triangles.push_back(clean.triangles[11]);
  got.triangles.push_back(clean.triangles[11]);
  got.triangles.push_back(clean.triangles[12]);
  Turn(&got.triangles.back());
  EXPECT_THROW(Mesh{got}, std::invalid_argument);
  const MeshReport report = Repaired(&got);
  EXPECT_EQ(report.without_area, 2);
  EXPECT_EQ(report.doubled, 3);
  EXPECT_EQ(report.turned, 0);
  EXPECT_EQ(got.triangles, clean.triangles);
  EXPECT_EQ(got.vertices, clean.vertices);
  EXPECT_EQ(report.Words(),
            "480 triangles, 1 closed shell; 2 triangles without area dropped; 3 copies dropped");
}

TEST(MeshRepair, AMeshTwiceInTheFileIsThereOnce) {
  TriangleSoup got = Wheel();
  got.triangles.insert(got.triangles.end(), got.triangles.begin(), got.triangles.begin() + 480);
  EXPECT_EQ(Repaired(&got).doubled, 480);
  EXPECT_EQ(got.triangles, Wheel().triangles);
}

/// A needle closes the gap that a vertex in a neighbour's side leaves.
TEST(MeshRepair, NeedlesLeaveAClosedMeshClosed) {
  TriangleSoup got = BoxSoup(0.3, 0.2, 0.1);
  const auto t = got.triangles[0];  // one side of it goes through points in between
  for (const double share : {0.25, 0.5, 0.75}) {
    got.vertices.push_back(
        Add(Scale(1 - share, got.vertices[t[0]]), Scale(share, got.vertices[t[1]])));
  }
  got.triangles[0] = {t[0], 8, t[2]};
  for (const auto& more : {std::array{8, 9, t[2]},
                           {9, 10, t[2]},
                           {10, t[1], t[2]},
                           {t[0], t[1], 9},
                           {t[0], 9, 8},
                           {9, t[1], 10}}) {
    got.triangles.push_back(more);
  }
  EXPECT_THROW(Mesh{got}, std::invalid_argument);
  const MeshReport report = Repaired(&got);
  EXPECT_EQ(report.without_area, 3);
  EXPECT_EQ(report.closed_shells, 1);
  EXPECT_EQ(report.open_edges, 0);
  EXPECT_NEAR(Volume(got), 0.6 * 0.4 * 0.2, 1e-15);
  ExpectSameContacts(got, BoxSoup(0.3, 0.2, 0.1), 1e-7);
}

TEST(MeshRepair, MixedWindingAndInsideOutGiveTheCleanMesh) {
  const TriangleSoup clean = Wheel();
  TriangleSoup mixed = clean;
  for (const int f : {0, 1, 17, 200, 401}) Turn(&mixed.triangles[f]);
  EXPECT_THROW(Mesh{mixed}, std::invalid_argument);
  MeshReport report = Repaired(&mixed);
  EXPECT_EQ(report.turned, 5);
  EXPECT_EQ(report.inside_out, 0);
  TriangleSoup inside_out = Reversed(clean);
  report = Repaired(&inside_out);
  EXPECT_EQ(report.turned, 0);
  EXPECT_EQ(report.inside_out, 1);
  TriangleSoup most = clean;  // all but a few against
  for (std::size_t f = 9; f < most.triangles.size(); ++f) Turn(&most.triangles[f]);
  report = Repaired(&most);
  EXPECT_EQ(report.turned, 471);
  EXPECT_EQ(report.inside_out, 0);
  for (const TriangleSoup& got : {mixed, inside_out, most}) {
    EXPECT_EQ(got.vertices, clean.vertices);
    EXPECT_NEAR(Volume(got), Volume(clean), 1e-15);
    ExpectSameContacts(got, clean);
  }
}

TEST(MeshRepair, AnOpenShellGetsTheWindingOfMost) {
  const TriangleSoup clean = Plate(4, [](double x, double) { return 0.1 * x; });
  TriangleSoup got = clean;
  for (const int f : {0, 1, 9}) Turn(&got.triangles[f]);
  const MeshReport report = Repaired(&got);
  EXPECT_EQ(report.turned, 3);
  EXPECT_EQ(report.open_edges, 16);
  EXPECT_EQ(got.triangles, clean.triangles);
}

TEST(MeshRepair, AVesselFacesInward) {
  const TriangleSoup vessel = Reversed(BoxSoup(0.3, 0.2, 0.1));
  TriangleSoup got = vessel;
  EXPECT_FALSE(Repaired(&got, SolidSide::kOutside).Changed());
  EXPECT_EQ(got.triangles, vessel.triangles);
  got = BoxSoup(0.3, 0.2, 0.1);
  EXPECT_EQ(Repaired(&got, SolidSide::kOutside).inside_out, 1);
  EXPECT_EQ(got.triangles, vessel.triangles);
}

TEST(MeshRepair, CavitiesKeepTheirSide) {
  const TriangleSoup outer = BoxSoup(0.4, 0.4, 0.4), inner = BoxSoup(0.1, 0.1, 0.1);
  const double hollow = Volume(outer) - Volume(inner);
  TriangleSoup got = Both(outer, Reversed(inner));
  MeshReport report = Repaired(&got);
  EXPECT_FALSE(report.Changed());
  EXPECT_EQ(report.cavities, 1);
  for (const TriangleSoup& bad : {Both(Reversed(outer), inner),  // all inside-out
                                  Both(Reversed(outer), Reversed(inner))}) {
    got = bad;
    report = Repaired(&got);
    EXPECT_NEAR(Volume(got), hollow, 1e-15);
    EXPECT_EQ(report.cavities, 1);
    ExpectSameContacts(got, Both(outer, Reversed(inner)));
  }
  // A ball in the cavity is outside of it again.
  const TriangleSoup ball = BoxSoup(0.02, 0.02, 0.02);
  got = Reversed(Both(Both(outer, Reversed(inner)), ball));
  EXPECT_EQ(Repaired(&got).inside_out, 3);
  EXPECT_NEAR(Volume(got), hollow + Volume(ball), 1e-15);
  // Two solids that cut each other (a grouser in a rim) both face outward.
  got = Both(outer, Reversed(BoxSoup(0.1, 0.1, 0.2)), {0.05, 0.05, 0.35});
  report = Repaired(&got);
  EXPECT_EQ(report.inside_out, 1);
  EXPECT_EQ(report.cavities, 0);
}

TEST(MeshRepair, SolidsThatShareAFaceAreUnited) {
  const TriangleSoup half = BoxSoup(0.15, 0.2, 0.1);
  TriangleSoup got = Both(half, half, {0.3, 0, 0});
  EXPECT_THROW(Mesh{got}, std::invalid_argument);
  const MeshReport report = Repaired(&got);
  EXPECT_EQ(report.inner_walls, 4);
  EXPECT_EQ(report.doubled, 0);
  EXPECT_EQ(report.closed_shells, 1);
  EXPECT_NEAR(Volume(got), 2 * Volume(half), 1e-15);
  for (Vec3d& v : got.vertices) v[0] -= 0.15;
  ExpectSameContacts(got, BoxSoup(0.3, 0.2, 0.1), 1e-7);
}

/// Two boxes at one edge; voxels that go on around both ends of it; any winding.
TEST(MeshRepair, EdgesOfFourAreSplit) {
  const TriangleSoup box = BoxSoup(0.1, 0.1, 0.1);
  for (const bool first_turned : {false, true}) {
    for (const bool second_turned : {false, true}) {
      TriangleSoup got = Both(first_turned ? Reversed(box) : box,
                              second_turned ? Reversed(box) : box, {0.2, 0.2, 0});
      EXPECT_THROW(Mesh{got}, std::invalid_argument);
      const MeshReport report = Repaired(&got);
      EXPECT_EQ(report.split_edges, 1);
      EXPECT_EQ(report.closed_shells, 2);
      EXPECT_EQ(report.open_edges, 0);
      EXPECT_NEAR(Volume(got), 2 * Volume(box), 1e-15);
    }
  }
  // Four cubes up the stairs and back: the edge between the first and the third is inside the body.
  TriangleSoup ring = box;
  for (const Vec3d& at : {Vec3d{0, 0, 0.2},
                          {0, 0.2, 0.2},
                          {0.2, 0.2, 0.2},
                          {0.2, 0.2, 0},
                          {0, 0, -0.2},
                          {0, 0.2, -0.2},
                          {0.2, 0.2, -0.2}}) {
    ring = Both(ring, box, at);
  }
  const MeshReport report = Repaired(&ring);
  EXPECT_EQ(report.split_edges, 1);
  EXPECT_EQ(report.inner_walls, 32);
  EXPECT_EQ(report.triangles, 66);  // of 64 two are cut, in the middle of that edge
  EXPECT_EQ(report.closed_shells, 1);
  EXPECT_NEAR(Volume(ring), 8 * Volume(box), 1e-15);
}

/// Where their triangles differ on the face that two solids share, they stay two.
TEST(MeshRepair, SolidsThatTouchArePairedAcrossTheirInside) {
  const TriangleSoup box = BoxSoup(0.1, 0.1, 0.1);
  TriangleSoup other = box;
  other.triangles[8] = {0, 4, 2};  // the other diagonal
  other.triangles[9] = {4, 6, 2};
  TriangleSoup got = Both(box, other, {0.2, 0, 0});
  const MeshReport report = Repaired(&got);
  EXPECT_EQ(report.split_edges, 4);
  EXPECT_EQ(report.closed_shells, 2);
  for (int f = 0; f < 12; ++f) {
    for (int g = 12; g < 24; ++g) {
      for (const std::int32_t v : got.triangles[f]) {
        for (const std::int32_t w : got.triangles[g]) ASSERT_NE(v, w);
      }
    }
  }
}

TEST(MeshRepair, AFinOnASolidIsASheetOfItsOwn) {
  TriangleSoup got = BoxSoup(0.1, 0.1, 0.1);
  got.vertices.push_back({0.1, 0.3, 0.1});
  got.vertices.push_back({-0.1, 0.3, 0.1});
  got.triangles.push_back({6, 7, 8});  // at the edge y = 0.1, z = 0.1
  got.triangles.push_back({6, 8, 9});
  EXPECT_THROW(Mesh{got}, std::invalid_argument);
  const MeshReport report = Repaired(&got);
  EXPECT_EQ(report.split_edges, 1);
  EXPECT_EQ(report.closed_shells, 1);
  EXPECT_EQ(report.open_shells, 1);
  EXPECT_EQ(report.open_edges, 4);
  got.triangles.resize(12);  // the solid is as it was
  EXPECT_EQ(got.triangles, BoxSoup(0.1, 0.1, 0.1).triangles);
  ExpectHas(report.Words(), "1 open shell (a thin sheet) with 4 open edges; 1 edge of three");
}

TEST(MeshRepair, CrossedSheetsArePaired) {
  TriangleSoup got;
  got.vertices = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
  for (int k = 2; k < 6; ++k) got.triangles.push_back({0, 1, k});
  const MeshReport report = Repaired(&got);
  EXPECT_EQ(report.open_shells, 2);
  EXPECT_EQ(report.split_edges, 1);
}

TEST(MeshRepair, RefusesByName) {
  TriangleSoup flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  flat.triangles = {{0, 1, 2}, {0, 0, 1}};
  ExpectHas(Complaint(flat), "m.stl: got no triangle with area");
  TriangleSoup strip;  // half a turn on the way round
  for (int i = 0; i < 12; ++i) {
    const double a = 2 * kPi * i / 12, b = 0.5 * a;
    for (const double s : {-0.2, 0.2}) {
      const double rho = 1 + s * std::cos(b);
      strip.vertices.push_back({rho * std::cos(a), rho * std::sin(a), s * std::sin(b)});
    }
  }
  for (int i = 0; i < 12; ++i) {
    const int last = i == 11;
    const int c = last ? 1 : 2 * i + 2, d = last ? 0 : 2 * i + 3;
    strip.triangles.push_back({2 * i, 2 * i + 1, c});
    strip.triangles.push_back({2 * i + 1, d, c});
  }
  ExpectHas(Complaint(strip), "one side only (a Moebius strip) at the edge from (");
  TriangleSoup tee;
  tee.vertices = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}};
  for (int k = 2; k < 5; ++k) tee.triangles.push_back({0, 1, k});
  ExpectHas(Complaint(tee), "3 triangles at the edge from (0, 0, 0) to (0, 0, 1), where an odd");
  TriangleSoup wall = BoxSoup(0.1, 0.1, 0.1);  // one copy of the face that two boxes share
  wall.triangles.erase(wall.triangles.begin() + 10, wall.triangles.end());
  wall = Both(wall, BoxSoup(0.1, 0.1, 0.1), {0.2, 0, 0});
  ExpectHas(Complaint(wall), "where an inner wall ends");
  TriangleSoup cut;  // needles within needles along an edge of many triangles
  cut.vertices = {{0, 0, 0}, {8, 0, 0}};
  for (int k = 0; k < 60; ++k) {
    cut.vertices.push_back({0, std::cos(0.1 * k), std::sin(0.1 * k)});
    cut.triangles.push_back({0, 1, k + 2});
  }
  const std::function<void(int, int, double, double)> halve = [&](int a, int b, double x,
                                                                  double y) {
    if (y - x < 0.5) return;
    const auto middle = static_cast<std::int32_t>(cut.vertices.size());
    cut.vertices.push_back({0.5 * (x + y), 0, 0});
    cut.triangles.push_back({a, b, middle});
    halve(a, middle, x, 0.5 * (x + y));
    halve(middle, b, 0.5 * (x + y), y);
  };
  halve(0, 1, 0, 8);
  ExpectHas(Complaint(cut), "cut up more than there are");
  TriangleSoup far = BoxSoup(1, 1, 1);
  far.vertices[0][0] = 1e31;
  ExpectHas(Complaint(far), "over 1e30");
}

}  // namespace
}  // namespace grouser::dem
