#include "dem_offline/engine/world/world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "dem_offline/engine/laws/contact_model.h"

namespace grouser::dem {
namespace {

WorldConfig Config() {
  WorldConfig c;
  c.frame = {0.3, 0.2, 1.0};
  c.gravity_m_per_s2 = {0, 0, -9.81};
  c.dt_s = 1e-4;
  c.contacts = OneMaterial({1e7, 0.3}, {0.5, 0.5, 0.1});
  return c;
}

Body Floor(double z_m) {
  const double up[3] = {0, 0, 1};
  Body b;
  b.shape = HalfSpace(up);
  b.position_m = {0, 0, z_m};
  return b;
}

Body Wheel(double spin, double yaw, double v_x) {
  Body w;
  w.shape = SmoothWheel(0.03, 0.04);
  w.motion = BodyMotion::kPrescribed;
  w.position_m = {0.15, 0.1, 0};
  w.orientation = {std::cos(yaw / 2), 0, 0, std::sin(yaw / 2)};
  w.velocity_m_per_s = {v_x, 0, 0};
  w.spin_rad_per_s = {-spin * std::sin(yaw), spin * std::cos(yaw), 0};
  return w;
}

TEST(World, SlowGrainsNeverStall) {  // 1e-6 m/s is about one quantum a step
  WorldConfig c = Config();
  c.gravity_m_per_s2 = {0, 0, 0};
  World world(c, {{0.1, 0.1, 0, 0.005, 2500, 1e-6, 0, 0}});
  for (int s = 0; s < 100000; ++s) world.Step();
  EXPECT_NEAR(world.State(0).x_m - 0.1, 1e-5, 1e-8);
}

TEST(World, GrainsWrapAroundThePeriod) {
  WorldConfig c = Config();
  c.gravity_m_per_s2 = {0, 0, 0};
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
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(World(Config(), {{0.1, 0.1, 0, 0.005, 2500, nan}}), std::invalid_argument);
  World broken(Config(), {{0.1, 0.1, 0, 0.005, 2500}});
  broken.SetVelocity(0, {nan, 0, 0}, {0, 0, 0});
  EXPECT_EQ(broken.Step(), StepFault::kNonFinite);
  World under(Config(), {{0.1, 0.1, 0, 0.005, 2500}});
  under.AddBody(Floor(0.05));
  EXPECT_EQ(under.Step(), StepFault::kTunnelled);
  EXPECT_EQ(under.Step(), StepFault::kTunnelled);  // and stays so
  World engulfed(Config(), {{0.1, 0.1, 0, 0.005, 2500}, {0.1, 0.1, 0.0002, 0.005, 2500}});
  engulfed.Start();
  EXPECT_EQ(engulfed.Step(), StepFault::kOverlap);
}

TEST(World, EmptyAndSingle) {
  World none(Config(), Contents{});
  EXPECT_EQ(none.Step(), StepFault::kNone);
  EXPECT_EQ(none.MeanContacts(), 0.0);
}

/// A grain pressed under a wheel that drives forward.
Wrench PressedUnder(double spin, double yaw, double v_x, double dx) {
  WorldConfig c = Config();
  c.gravity_m_per_s2 = {0, 0, 0};
  World world(c, {{0.15 + dx, 0.1, -0.0345, 0.005, 2500}});
  world.AddBody(Wheel(spin, yaw, v_x));
  world.Step();
  return world.wrench(0);
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
  c.gravity_m_per_s2 = {0, 0, 0};
  World world(c, {{0.155, 0.1, -0.0335, 0.005, 2500}});
  world.AddBody(Wheel(5, 0, 0));
  world.Step();
  EXPECT_NEAR(world.wrench(0).fx, -world.loads()[0].fx, 1e-5);
  EXPECT_NEAR(world.wrench(0).fz, -world.loads()[0].fz, 1e-5);
}

TEST(World, ContactsOfABodyAddUpToItsWrench) {
  WorldConfig c = Config();
  c.contacts = OneMaterial({1e7, 0.3}, {1.0, 0.5, 0.1});  // no damper: forces of springs alone
  std::vector<GrainState> grains;
  for (int k = 0; k < 5; ++k)
    grains.push_back({0.13 + 0.011 * k, 0.1, -0.0348, 0.005, 2500, 0, 0, 0.3});
  World world(c, grains);
  world.AddBody(Floor(-0.2));
  const int wheel = world.AddBody(Wheel(20, 0.3, 0.1));
  world.Start();
  int met = 0;
  for (int step = 0; step < 60; ++step) {
    std::vector<BodyContact> recorded;
    world.RecordContacts([&](const BodyContact& b) {
      if (b.body == wheel) recorded.push_back(b);
    });
    ASSERT_EQ(world.Step(), StepFault::kNone);
    world.RecordContacts(nullptr);
    const std::uint64_t before = world.Hash();
    const std::vector<BodyContact> now = world.ContactsOf(wheel);
    EXPECT_EQ(world.Hash(), before);
    ASSERT_EQ(now.size(), recorded.size());
    met += static_cast<int>(now.size());
    Vec3f sum = {0, 0, 0};
    for (std::size_t k = 0; k < now.size(); ++k) {
      sum = sum + now[k].force;
      EXPECT_GT(Dot(now[k].normal, recorded[k].normal), 1 - 1e-5f);
      EXPECT_LT(Dot(now[k].normal, now[k].force), 0);  // pressed, not pulled
      EXPECT_EQ(now[k].part, recorded[k].part);
    }
    const Wrench all = world.wrench(wheel);
    const double size = Norm(Vec3d{all.fx, all.fy, all.fz});
    EXPECT_NEAR(sum.x, all.fx, 1e-4 * size);
    EXPECT_NEAR(sum.y, all.fy, 1e-4 * size);
    EXPECT_NEAR(sum.z, all.fz, 1e-4 * size);
  }
  EXPECT_GT(met, 10);
}

TEST(World, EpsdHoldsASpinningGrainBack) {
  const double r = 0.005;
  WorldConfig c = Config();
  c.dt_s = 1e-6;
  World world(c, {{0.05, 0.05, r - 1e-6, r, 2500, 0.05, 0, 0, 0, 0.05 / r, 0}});
  world.AddBody(Floor(0));
  for (int s = 0; s < 400000; ++s) world.Step();
  EXPECT_NEAR(world.State(0).v_x, 0, 1e-6);  // static, not creeping
  EXPECT_NEAR(world.State(0).w_y, 0, 1e-3);
}

TEST(World, TheGuardRefusesALargeStepByName) {
  WorldConfig c = Config();
  c.guard_overlap = 0.05;
  c.dt_s = 1e-6;
  const std::vector<GrainState> one = {{0.1, 0.1, 0, 0.005, 2500}};
  const double critical = World(c, one).CriticalStep(0.05);
  c.dt_s = 0.99 * critical;
  EXPECT_NO_THROW(World(c, one));
  c.dt_s = 1.01 * critical;
  try {
    World(c, one);
    FAIL() << "the step was taken";
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("dt_s"), std::string::npos);
    EXPECT_NE(std::string(e.what()).find("critical"), std::string::npos);
  }
}

TEST(World, ABodyPutElsewhereByHandIsFelt) {
  WorldConfig c = Config();
  c.gravity_m_per_s2 = {0, 0, 0};
  World world(c, {{0.1, 0.1, 0, 0.005, 2500}});
  world.AddBody(Floor(-0.1));
  world.Run(3);
  EXPECT_EQ(world.LoadOf(0).touching, 0.0f);
  world.body(0).position_m[2] = -0.0049;  // lifted under the grain
  world.Run(1);
  EXPECT_EQ(world.LoadOf(0).touching, 1.0f);
}

/// A free body falls, lands on a grain bed of one, and keeps momentum with it.
TEST(World, AFreeBodyAndAGrainExchangeMomentum) {
  WorldConfig c = Config();
  c.gravity_m_per_s2 = {0, 0, 0};
  c.energy = true;
  c.dt_s = 1e-6;
  World world(c, {{0.1, 0.1, 0.0, 0.005, 2500}});
  Body box;
  box.shape = Box(0.02, 0.03, 0.01);
  box.motion = BodyMotion::kFree;
  box.mass_kg = 0.01;
  box.inertia_kg_m2 = {1e-6, 5e-7, 1.3e-6};
  box.position_m = {0.105, 0.102, 0.0105};
  box.velocity_m_per_s = {0, 0, -0.2};
  world.AddBody(box);
  const double m = world.State(0).mass_kg;
  for (int s = 0; s < 20000; ++s) ASSERT_EQ(world.Step(), StepFault::kNone);
  const GrainState g = world.State(0);
  const Body& b = world.body(0);
  EXPECT_GT(std::abs(b.spin_rad_per_s[1]), 0.1);  // struck off its centre
  EXPECT_NEAR(m * g.v_z + 0.01 * b.velocity_m_per_s[2], -0.002, 2e-8);
  EXPECT_NEAR(m * g.v_x + 0.01 * b.velocity_m_per_s[0], 0, 2e-8);
  const EnergyBalance e = world.Balance();
  EXPECT_NEAR(e.Total(), 0.5 * 0.01 * 0.04, 2e-7);  // 0.1 % of the beginning
}

}  // namespace
}  // namespace grouser::dem
