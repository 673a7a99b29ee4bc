#include "dem_offline/engine/world/world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "dem_offline/engine/laws/material.h"

namespace grouser::dem {
namespace {

WorldConfig Config() {
  WorldConfig c;
  c.frame = {0.3, 0.2, 1.0};
  c.gravity_m_per_s2 = 9.81;
  c.dt_s = 1e-4;
  c.grain_grain = MakeParams({1e7, 0.3}, {1e7, 0.3}, {0.5, 0.5, 0.1});
  c.grain_floor = c.grain_wheel = MakeWallParams({1e7, 0.3}, {0.5, 0.5, 0.1});
  return c;
}

TEST(World, SlowGrainsNeverStall) {  // 1e-6 m/s is about one quantum a step
  WorldConfig c = Config();
  c.gravity_m_per_s2 = 0;
  World world(c, {{0.1, 0.1, 0, 0.005, 2500, 1e-6, 0, 0}});
  for (int s = 0; s < 100000; ++s) world.Step();
  EXPECT_NEAR(world.State(0).x_m - 0.1, 1e-5, 1e-8);
}

TEST(World, GrainsWrapAroundThePeriod) {
  WorldConfig c = Config();
  c.gravity_m_per_s2 = 0;
  World world(c, {{0.2995, 0.1, 0, 0.005, 2500, 1, 0, 0}});
  for (int s = 0; s < 10; ++s) world.Step();
  EXPECT_NEAR(world.State(0).x_m, 0.0005, 1e-6);
}

TEST(World, FreeFallIsExactInTime) {
  World world(Config(), {{0.1, 0.1, 0.2, 0.005, 2500}});
  for (int s = 0; s < 1000; ++s) world.Step();
  EXPECT_NEAR(world.State(0).z_m, 0.2 - 0.5 * 9.81 * 0.01, 1e-6);
  EXPECT_NEAR(world.State(0).v_z, -0.981, 1e-4);
}

TEST(World, FaultsAreNamed) {
  World fast(Config(), {{0.1, 0.1, 0, 0.005, 2500, 100, 0, 0}});
  EXPECT_EQ(fast.Step(), StepFault::kTooFast);
  World broken(Config(), {{0.1, 0.1, 0, 0.005, 2500, std::numeric_limits<double>::quiet_NaN()}});
  EXPECT_EQ(broken.Step(), StepFault::kNonFinite);
  WorldConfig c = Config();
  c.floor_z_m = 0.05;
  World under(c, {{0.1, 0.1, 0, 0.005, 2500}});
  EXPECT_EQ(under.Step(), StepFault::kTunnelled);
  EXPECT_EQ(under.Step(), StepFault::kTunnelled);  // and stays so
}

TEST(World, EmptyAndSingle) {
  World none(Config(), {});
  EXPECT_EQ(none.Step(), StepFault::kNone);
  EXPECT_EQ(none.MeanContacts(), 0.0);
}

TEST(WheelDistance, FacesEdgesAndInside) {
  const float r = 0.06f, h = 0.025f;
  EXPECT_NEAR(WheelDistance(r, h, {0, 0, -0.07f}).distance, 0.01, 1e-7);
  EXPECT_NEAR(WheelDistance(r, h, {0, 0.03f, 0}).distance, 0.005, 1e-7);
  const SignedDistance edge = WheelDistance(r, h, {0.063f, -0.029f, 0});
  EXPECT_NEAR(edge.distance, 0.005, 1e-6);
  EXPECT_NEAR(edge.normal.x, 0.6, 1e-4);
  EXPECT_NEAR(edge.normal.y, -0.8, 1e-4);
  EXPECT_NEAR(WheelDistance(r, h, {0, 0, -0.055f}).distance, -0.005, 1e-7);
  // Brute force: the nearest point of a sampled surface.
  for (const Vec3f p : {Vec3f{0.05f, 0.01f, -0.06f}, Vec3f{-0.02f, 0.04f, 0.07f}, Vec3f{0.01f, -0.03f, 0.02f}}) {
    double best = 1e9;
    for (int a = 0; a < 2000; ++a) {
      const double t = 2 * M_PI * a / 2000;
      for (int k = -100; k <= 100; ++k) {
        const double x = r * std::cos(t), z = r * std::sin(t), y = h * k / 100.0;
        best = std::min(best, std::hypot(p.x - x, p.y - y, p.z - z));
        const double s = (k + 100) / 200.0;
        for (const double side : {-1.0, 1.0}) {
          best = std::min(best, std::hypot(p.x - s * x, p.y - side * h, p.z - s * z));
        }
      }
    }
    EXPECT_NEAR(WheelDistance(r, h, p).distance, best, 2e-4);
  }
}

/// A grain pressed under a wheel that drives forward.
Wrench PressedUnder(double spin, double yaw, double v_x, double dx) {
  WorldConfig c = Config();
  c.gravity_m_per_s2 = 0;
  World world(c, {{0.15 + dx, 0.1, -0.0345, 0.005, 2500}});
  WheelBody w;
  w.radius_m = 0.03;
  w.width_m = 0.04;
  w.x_m = 0.15;
  w.y_m = 0.1;
  w.yaw_rad = yaw;
  w.v_x = v_x;
  w.spin = spin;
  world.EnableWheel(w);
  world.Step();
  return world.wrench();
}

TEST(World, SignsOfTheWheelWrench) {
  const Wrench still = PressedUnder(0, 0, 0, 0);
  EXPECT_GT(still.fz, 0);  // soil carries the wheel
  EXPECT_NEAR(still.fx, 0, 1e-6 * still.fz);
  const Wrench driven = PressedUnder(10, 0, 0, 0);
  EXPECT_GT(driven.fx, 0);  // traction pulls forward
  EXPECT_LT(driven.ty, 0);  // against the spin: drive torque -ty is positive
  const Wrench dragged = PressedUnder(0, 0, 0.1, 0);
  EXPECT_LT(dragged.fx, 0);
  EXPECT_GT(dragged.ty, 0);
  const Wrench turned = PressedUnder(10, M_PI / 2, 0, 0);  // wheel plane along +y
  EXPECT_GT(turned.fy, 0);
  EXPECT_NEAR(turned.fx, 0, 1e-4 * turned.fz);
}

TEST(World, ActionEqualsReactionAtTheWheel) {
  WorldConfig c = Config();
  c.gravity_m_per_s2 = 0;
  World world(c, {{0.155, 0.1, -0.0335, 0.005, 2500}});
  WheelBody w;
  w.radius_m = 0.03;
  w.width_m = 0.04;
  w.x_m = 0.15;
  w.y_m = 0.1;
  w.spin = 5;
  world.EnableWheel(w);
  world.Step();
  EXPECT_NEAR(world.wrench().fx, -world.loads()[0].fx, 1e-5);
  EXPECT_NEAR(world.wrench().fz, -world.loads()[0].fz, 1e-5);
}

}  // namespace
}  // namespace grouser::dem
