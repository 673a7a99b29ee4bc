// A shear cell in a file: spheres on a turning wheel, scattered grains, rings.
#include <gtest/gtest.h>

#include <cmath>

#include "dem_offline/engine/core/random.h"
#include "dem_offline/engine/core/rotation.h"
#include "dem_offline/engine/experiment/scatter.h"
#include "dem_offline/engine/experiment/shapes.h"
#include "experiment_testing.h"

namespace grouser::dem::experiment {
namespace {

Vec3f RandomPoint(Random* random, double reach) {
  const auto one = [&] { return static_cast<float>(random->Between(-reach, reach)); };
  return {one(), one(), one()};
}

TEST(Spheres, DistanceOfASphere) {
  const Shape sphere = Sphere(0.03);
  SurfacePoint found[kMostSurfacePoints];
  ASSERT_EQ(SurfacePoints(sphere, {0.03f, 0.04f, 0}, 0.05f, found), 1);
  EXPECT_NEAR(found[0].distance, 0.02, 1e-8);
  EXPECT_NEAR(found[0].normal.x, 0.6, 1e-6);
  EXPECT_NEAR(found[0].normal.y, 0.8, 1e-6);
  ASSERT_EQ(SurfacePoints(sphere, {0, 0, 0}, 0.05f, found), 1);
  EXPECT_NEAR(found[0].distance, -0.03, 1e-8);
}

/// A ring on a wheel is looked at as what it is: the union of the wheel and all spheres.
TEST(Spheres, RingOnAWheelIsTheUnionOfItsParts) {
  PartSpec wheel, spheres;
  wheel.shape = PartShape::kWheel;
  wheel.radius_m = 0.08;
  wheel.width_m = 0.02;
  spheres.shape = PartShape::kSpheres;
  spheres.radius_m = 0.004;
  spheres.ring_radius_m = 0.08;
  spheres.count = 37;
  const Shape shape = ShapeOf({wheel, spheres}, "b");
  ASSERT_EQ(shape.parts.size(), 38u);
  ASSERT_EQ(shape.rings.size(), 1u);
  EXPECT_EQ(shape.rings[0].first, 1);
  Shape plain = shape;
  plain.rings.clear();
  Random random(3);
  int touching = 0;
  for (int k = 0; k < 20000; ++k) {
    const Vec3f p = RandomPoint(&random, 0.1);
    SurfacePoint a[kMostSurfacePoints], b[kMostSurfacePoints];
    const int n = SurfacePoints(shape, p, 0.006f, a);
    ASSERT_EQ(n, SurfacePoints(plain, p, 0.006f, b));
    float nearest = std::hypot(p.x, p.z) - 0.08f;  // on the rim's face
    const bool at_rim = std::abs(p.y) < 0.009f && nearest > -0.001f;
    for (int s = 0; s < 37; ++s) {
      const double angle = 2 * M_PI * s / 37;
      const double d = std::hypot(p.x - 0.08 * std::sin(angle), p.y, p.z - 0.08 * std::cos(angle));
      nearest = std::min(nearest, static_cast<float>(d - 0.004));
    }
    float got = 1;
    for (int i = 0; i < n; ++i) {
      EXPECT_EQ(a[i].key, b[i].key);
      got = std::min(got, a[i].distance);
    }
    if (at_rim && nearest < 0.006f) {
      ++touching;
      EXPECT_NEAR(got, nearest, 1e-6);
    }
    EXPECT_LE(SweptDistance(shape, p), got);
  }
  EXPECT_GT(touching, 100);
}

TEST(Spheres, MassIsThatOfAllSpheres) {
  PartSpec spheres;
  spheres.shape = PartShape::kSpheres;
  spheres.radius_m = 0.004;
  spheres.ring_radius_m = 0.08;
  spheres.count = 12;
  const MassProperties m = MassOf({spheres}, "b");
  const double one = 4.0 / 3 * M_PI * 0.004 * 0.004 * 0.004;
  EXPECT_NEAR(m.volume_m3, 12 * one, 1e-12 * one);
  EXPECT_NEAR(m.tensor_m5[1], 12 * one * (0.08 * 0.08 + 0.4 * 0.004 * 0.004), 1e-9 * one);
}

BodySpec WheelWithASphere() {
  BodySpec b;
  b.name = "wheel";
  b.material = "steel";
  PartSpec wheel, spheres;
  wheel.shape = PartShape::kWheel;
  wheel.radius_m = 0.1;
  wheel.width_m = 0.1;
  spheres.shape = PartShape::kSpheres;
  spheres.radius_m = 0.01;
  spheres.ring_radius_m = 0.1;
  spheres.count = 1;  // at body z, which the turn puts along -y of the world
  b.parts = {wheel, spheres};
  b.position_m = {0.5, 0.5, 0.5};
  b.turn = {std::sqrt(0.5), std::sqrt(0.5), 0, 0};  // its axle along z
  return b;
}

/// A glued sphere goes round with its wheel: it meets a grain in its way when it is due there.
TEST(Spheres, MoveAsOneWithTheBody) {
  Experiment e = Empty();
  e.gravity_m_per_s2 = 0;
  GrainState& grain = e.grains[0].listed[0];
  grain.radius_m = 0.005;
  const double rho = 0.107;  // 2 mm off the wheel
  grain.x_m = 0.5 + rho;
  grain.y_m = 0.5;
  grain.z_m = 0.5;
  BodySpec wheel = WheelWithASphere();
  MotionStep turn;
  turn.verb = "turn";
  turn.spin_rad_per_s = {0, 0, 10};
  turn.for_s = 0.2;
  wheel.motion = {turn};
  e.bodies = {wheel};
  Probe energy;
  energy.kind = Probe::Kind::kRest;  // without gravity: the kinetic energy
  e.probes = {energy};
  e.sample_s = 1e-3;
  Recorded got;
  const Result result = RunExperiment(e, got.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  const auto time = got.Column("time_s"), kinetic = got.Column("kinetic_over_weight");
  std::size_t k = 0;
  while (k < time.size() && !(kinetic[k] > 0)) ++k;
  ASSERT_LT(k, time.size());
  // Contact where the centres are 15 mm apart: 0.1^2 + rho^2 - 0.2 rho cos(a) = 0.015^2.
  const double lag = std::acos((0.01 + rho * rho - 0.015 * 0.015) / (0.2 * rho));
  EXPECT_NEAR(time[k], (0.5 * M_PI - lag) / 10, 2.1e-3);
}

TEST(Scattered, NoneOverlapsAndAllLieInTheAnnulus) {
  for (const bool planar : {false, true}) {
    BoxSpec box;
    box.length_m = box.width_m = 0.3;
    box.height_m = planar ? 0.3 : 0.00762;
    box.planar = planar;
    if (planar) box.width_m = 0.04;
    Grains g;
    g.sizes = {{0.0047625, 1.0}};
    g.region = {{0, 0, 0}, {box.length_m, box.width_m, box.height_m}, 0.142875, 0.085725};
    g.areal_fraction = 0.75;
    const std::int64_t n = CountByArea(g, box);
    EXPECT_EQ(n, 1728);  // 0.75 (r_o^2 - r_i^2)/(d/2)^2
    BodySpec spec = WheelWithASphere();
    spec.parts[0].radius_m = spec.parts[1].ring_radius_m = 0.085725;
    spec.parts[1].radius_m = 0.00238125;
    spec.parts[1].count = 70;
    if (planar) spec.turn = {1, 0, 0, 0};
    spec.position_m = Scale(0.5, g.region.high_m);
    const Body wheel = BuildBody(spec, {}, 1, false, "b").body;
    Random random(5);
    const double r = 0.00238125;
    const auto at =
        Scatter(box, g.region, std::vector<double>(n, r), {wheel}, "grains", &random, [] {});
    ASSERT_EQ(at.size(), static_cast<std::size_t>(n));
    double nearest = 1, nearest_to_body = 1, inner = 1, outer = 0;
    const auto m = MatrixOf(wheel.orientation);
    for (std::size_t i = 0; i < at.size(); ++i) {
      const Vec3d d = Sub(at[i], spec.position_m);
      const double rho = planar ? std::hypot(d[0], d[2]) : std::hypot(d[0], d[1]);
      inner = std::min(inner, rho - r);
      outer = std::max(outer, rho + r);
      if (planar) {
        EXPECT_EQ(at[i][1], 0.02);
      }
      for (int k = 0; k < 3; ++k) {
        if (planar && k == 1) continue;
        EXPECT_GE(at[i][k], r * (1 - 2e-3));
        EXPECT_LE(at[i][k], g.region.high_m[k] - r * (1 - 2e-3));
      }
      const Vec3d b = m.Back(d);
      SurfacePoint found[kMostSurfacePoints];
      const int count = SurfacePoints(
          wheel.shape,
          {static_cast<float>(b[0]), static_cast<float>(b[1]), static_cast<float>(b[2])},
          static_cast<float>(r), found);
      for (int k = 0; k < count; ++k) {
        nearest_to_body = std::min<double>(nearest_to_body, found[k].distance);
      }
      for (std::size_t j = 0; j < i; ++j) nearest = std::min(nearest, Norm(Sub(at[i], at[j])));
    }
    EXPECT_GT(nearest, 2 * r * (1 - 1e-3));
    EXPECT_GT(nearest_to_body, r * (1 - 3e-3));
    EXPECT_GT(inner, 0.085725 - 1e-5);
    EXPECT_LT(outer, 0.142875 + 1e-5);
  }
}

TEST(Scattered, RefusesMoreThanFit) {
  BoxSpec box;
  box.length_m = box.width_m = 0.1;
  box.height_m = 0.01;
  const Region region = {{0, 0, 0}, {0.1, 0.1, 0.01}, 0};
  Random random(5);
  try {
    Scatter(box, region, std::vector<double>(150, 0.005), {}, "grains[0].count", &random, [] {});
    FAIL() << "150 grains in a layer of 10 x 10";
  } catch (const SpecError& error) {
    EXPECT_EQ(error.field(), "grains[0].count");
  }
}

/// Grains with known velocities, each far from the others: means over grains and over time.
TEST(Rings, MeansOfKnownVelocities) {
  for (const bool planar : {false, true}) {
    Experiment e = Empty();
    e.gravity_m_per_s2 = 0;
    e.duration_s = 0.02;
    e.box.planar = planar;
    e.grains[0].listed.clear();
    const int up = planar ? 1 : 2, u = (up + 1) % 3, w = (up + 2) % 3;
    const auto add = [&](double rho, double angle, double radial, double along) {
      double x[3], v[3] = {0, 0, 0};
      x[up] = 0.5;
      x[u] = 0.5 + rho * std::cos(angle);
      x[w] = 0.5 + rho * std::sin(angle);
      v[u] = radial * std::cos(angle) - along * std::sin(angle);
      v[w] = radial * std::sin(angle) + along * std::cos(angle);
      e.grains[0].listed.push_back({x[0], x[1], x[2], 0.01, 0, v[0], v[1], v[2]});
    };
    add(0.15, 0.3, 0.010, 0.03);  // in the first ring of 0.1 to 0.2
    add(0.15, 2.9, -0.010, 0.05);
    add(0.25, 4.0, 0, -0.02);  // in the second
    add(0.35, 1.0, 0, 1.0);    // beyond
    Probe p;
    p.kind = Probe::Kind::kRings;
    p.name = "rings";
    p.region = {{0, 0, 0}, {1, 1, 1}, 0.3, 0.1};
    p.rings = 2;
    p.from_s = 0.01;
    e.probes = {p};
    e.sample_s = 1e-3;
    Recorded got;
    const Result result = RunExperiment(e, got.Sink(), nullptr);
    ASSERT_TRUE(result.done) << result.reason;
    const auto column = [&](const char* name) { return got.Column(name, "rings"); };
    ASSERT_EQ(column("grains").size(), 2u);
    EXPECT_NEAR(column("low_m")[1], 0.2, 1e-12);
    EXPECT_NEAR(column("grains")[0], 2, 1e-12);
    EXPECT_NEAR(column("grains")[1], 1, 1e-12);
    EXPECT_NEAR(column("areal_fraction")[0], 2 * 0.01 * 0.01 / (0.04 - 0.01), 1e-9);
    EXPECT_NEAR(column("v_t_m_per_s")[0], 0.04, 2e-4);  // directions turn as the grains move on
    EXPECT_NEAR(column("v_r_m_per_s")[0], 0, 2e-4);
    EXPECT_NEAR(column("v_t_m_per_s")[1], -0.02, 1e-4);
    EXPECT_NEAR(column("temperature_m2_per_s2")[0], (1e-4 + 1e-4) / 3, 3e-6);
    EXPECT_NEAR(column("temperature_m2_per_s2")[1], 0, 1e-8);
  }
}

}  // namespace
}  // namespace grouser::dem::experiment
