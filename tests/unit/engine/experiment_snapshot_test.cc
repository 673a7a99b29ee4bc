// Frames: surfaces of shapes, times, and what the grains carry.
#include <gtest/gtest.h>

#include <cmath>

#include "dem_offline/engine/experiment/snapshot.h"
#include "tests/unit/engine/experiment_testing.h"

namespace grouser::dem::experiment {
namespace {

/// Volume and area that the triangles of a shape enclose.
struct Solid {
  double volume = 0, area = 0;
};
Solid SolidOf(const TriangleSoup& soup) {
  Solid out;
  for (const auto& t : soup.triangles) {
    const Vec3d &a = soup.vertices[t[0]], &b = soup.vertices[t[1]], &c = soup.vertices[t[2]];
    const Vec3d normal = CrossD(Sub(b, a), Sub(c, a));
    out.volume += DotD(a, normal) / 6;
    out.area += 0.5 * Norm(normal);
  }
  return out;
}

TEST(Snapshot, TrianglesEncloseTheirShapes) {
  constexpr int kFine = 720;
  const auto check = [](const Shape& shape, double volume, double area) {
    const Solid s = SolidOf(TrianglesOf(shape, kFine));
    EXPECT_NEAR(s.volume, volume, 1e-4 * std::max(volume, 1e-3));
    EXPECT_NEAR(s.area, area, 1e-4 * area);
  };
  check(Box(2, 3, 4), 24, 52);
  check(SmoothWheel(2, 3), M_PI * 4 * 3, 2 * M_PI * 2 * 3 + 2 * M_PI * 4);
  check(HollowCylinder(2, 3, 1), M_PI * (9 - 4) * 3, 2 * M_PI * (2 + 3) * 3 + 2 * M_PI * (9 - 4));
  check(Sphere(2), M_PI * 32 / 3, M_PI * 16);
  check(Disc(2), 0, M_PI * 4);
  check(Annulus(1, 2), 0, M_PI * 3);
  EXPECT_TRUE(TrianglesOf(HalfSpace(Vec3d{0, 0, 1}.data())).triangles.empty());
  // Every bar is a closed solid of its own, beyond the rim and within.
  const Shape bars = TreadedWheel(1, 0.5, {{.count = 6, .height_m = 0.1, .root_thickness_m = 0.1}});
  for (const Vec3d& v : TrianglesOf(bars).vertices) EXPECT_LE(Norm(v), bars.reach * (1 + 1e-6));
  EXPECT_GT(SolidOf(TrianglesOf(bars, kFine)).volume, M_PI * 0.5);
}

TEST(Snapshot, ComesAtItsTimesAndAtTheEndAndFollowsBodies) {
  Experiment e = Empty();
  MotionStep move;
  move.verb = "move";
  move.velocity_m_per_s = {0.2, 0, 0};
  move.spin_rad_per_s = {0, 0, M_PI / 2};
  move.for_s = 0.05;
  e.bodies = {Ball({move})};
  e.bodies[0].parts[0].shape = PartShape::kBox;
  e.bodies[0].parts[0].size_m = {0.1, 0.02, 0.02};
  const auto times = [&](const FrameSpec& frames) {
    e.frames = frames;
    std::vector<Snapshot> out;
    RunExtras extras;
    extras.frame = [&](const Snapshot& s) { out.push_back(s); };
    RunExperiment(e, nullptr, nullptr, {}, extras);
    return out;
  };
  const auto every = times({.every_s = 0.02, .times_s = {}});
  ASSERT_EQ(every.size(), 4u);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(every[k].time_s, 0.02 * k, 2e-4);
  EXPECT_NEAR(every[3].time_s, 0.05, 2e-4);
  EXPECT_EQ(every[0].grains.size(), 1u);
  EXPECT_EQ(every[0].bodies, std::vector<std::string>{"ball"});
  double x = 0, furthest = 0;
  for (const Vec3d& v : every[3].triangles.vertices) x += v[0] / 8;
  EXPECT_NEAR(x, 0.5 + 0.2 * every[3].time_s, 1e-6);
  for (const Vec3d& v : every[3].triangles.vertices) furthest = std::max(furthest, v[0] - x);
  const double turned = M_PI / 2 * every[3].time_s;
  EXPECT_NEAR(furthest, 0.05 * std::cos(turned) + 0.01 * std::sin(turned), 1e-6);
  const auto listed = times({.every_s = 0, .times_s = {0.01, 0.03}});
  ASSERT_EQ(listed.size(), 3u);
  EXPECT_NEAR(listed[1].time_s, 0.03, 2e-4);
  EXPECT_TRUE(times({}).empty());
}

TEST(Snapshot, RefusesTimesThatCannotBe) {
  Experiment e = Empty();
  e.duration_s = 1;
  e.frames.times_s = {0.2, 0.1};
  EXPECT_THROW(PlanOf(e), SpecError);
  e.frames.times_s = {-1};
  EXPECT_THROW(PlanOf(e), SpecError);
  e.frames = {.every_s = 1e-9, .times_s = {}};
  EXPECT_THROW(PlanOf(e), SpecError);
  e.frames = {};
  e.checkpoint_every_s = 1e-9;
  EXPECT_THROW(PlanOf(e), SpecError);
}

}  // namespace
}  // namespace grouser::dem::experiment
