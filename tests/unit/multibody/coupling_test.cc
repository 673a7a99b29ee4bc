// A World and its jointed bodies in step.
#include "dem_offline/multibody/coupling.h"

#include <gtest/gtest.h>

#include "dem_offline/engine/laws/material.h"
#include "tests/unit/multibody/multibody_testing.h"

namespace grouser::dem {
namespace {

constexpr double kYoung = 1e7, kPoisson = 0.3;

WorldConfig Config(double dt, double gravity, double restitution, double friction) {
  WorldConfig c;
  c.frame = {1, 1, 2};
  c.gravity_m_per_s2 = {0, 0, gravity};
  c.dt_s = dt;
  c.skin_m = 0.01;
  c.energy = true;
  c.contacts = OneMaterial({kYoung, kPoisson}, {restitution, friction, 0});
  return c;
}

Body Block(Vec3d at, Vec3d size, BodyMotion motion) {
  Body b;
  b.shape = Box(size[0], size[1], size[2]);
  b.position_m = at;
  b.motion = motion;
  return b;
}

/// A block on a vertical slider bounces on a sphere that does not move.
TEST(Coupling, SliderOnAHertzSphereBouncesLikeItsEquation) {
  const double r = 0.05, mass = 2, dt = 2e-5, gravity = -9.81;
  const double k =
      4.0 / 3.0 * EffectiveModulus({kYoung, kPoisson}, {kRigid, kPoisson}) * std::sqrt(r);
  const double rest = std::pow(mass * kG / k, 2.0 / 3.0);
  World world(Config(dt, gravity, 1.0, 0.0), {{0.5, 0.5, 0, r, 2500, 0, 0, 0, 0, 0, 0, 0, true}});
  const double start = 0.5 * rest;  // overlap; less than at rest, so that contact is kept
  const Vec3d at = {0.5, 0.5, r - start + 0.05};
  const int block = world.AddBody(Block(at, {0.2, 0.2, 0.1}, BodyMotion::kPrescribed));
  MultibodySpec spec;
  spec.gravity_m_per_s2 = {0, 0, gravity};
  spec.bodies = {Solid("block", mass, {0.01, 0.01, 0.01}, at)};
  spec.joints = {JointAt(spec, "rail", JointType::kTranslational, kGround, "block", at, {0, 0, 1})};
  MultibodySystem bodies(spec);
  CoupledBodies both(&world, &bodies, {{"block", block}});
  // Runge-Kutta 4 of m x" = k x^1.5 - m g for the overlap x, downwards positive.
  double x = start, v = 0;
  const auto a = [&](double overlap) { return kG - k * std::pow(overlap, 1.5) / mass; };
  double worst = 0, grains = 0, largest = 0;
  for (int s = 0; s < 3000; ++s) {
    ASSERT_EQ(both.Step(), StepFault::kNone);
    const double k1 = a(x), k2 = a(x + dt / 2 * v), k3 = a(x + dt / 2 * v + dt * dt / 4 * k1),
                 k4 = a(x + dt * v + dt * dt / 2 * k2);
    x += dt * v + dt * dt / 6 * (k1 + k2 + k3);
    v += dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    worst = std::max(worst, std::abs(at[2] + start - x - bodies.Placement(0).position_m[2]));
    grains = std::max(grains, std::abs(bodies.Energy().grains));
    largest = std::max(largest, bodies.Energy().kinetic);
    // Stored in the sphere's contact: what the block has done (it is all that moves).
    ASSERT_NEAR(bodies.Energy().Balance(), mass * kG * at[2], 1e-3 * mass * kG * rest);
  }
  EXPECT_LT(worst, 1e-3 * rest);
  EXPECT_GT(largest, 0.05 * mass * kG * rest);  // it did move
  EXPECT_NEAR(world.state().bodies.at(block).work_j, -bodies.Energy().grains, 1e-3 * grains);
  EXPECT_NEAR(world.body(block).position_m[2], bodies.Placement(0).position_m[2], 1e-14);
  EXPECT_NEAR(bodies.ReactionIn("rail", kGround, spec.joints[0].in_parent).fz, 0, 1e-9);
}

/// How far a free block that falls askew on loose spheres is from the engine's own free body.
struct Falls {
  double before = 0, after = 0;  ///< [m] largest until the first touch, at 15 ms after it
  double peak_n = 0;
};
Falls FallOfBoth(double dt) {
  const double r = 0.02, mass = 0.6;
  const Vec3d inertia = {6e-4, 8e-4, 9e-4}, at = {0.5, 0.5, 0.09};
  std::vector<GrainState> grains;
  for (int i = -3; i <= 3; ++i) {
    for (int j = -3; j <= 3; ++j) {
      grains.push_back({0.5 + 0.041 * i, 0.5 + 0.041 * j, r, r, 2500});
    }
  }
  // Elastic: the engine's damping knows the mass of free bodies alone (docs/multibody.md).
  const WorldConfig config = Config(dt, -9.81, 1.0, 0.4);
  World one(config, grains), two(config, grains);
  const double up[3] = {0, 0, 1};
  for (World* w : {&one, &two}) {
    Body floor;
    floor.shape = HalfSpace(up);
    w->AddBody(floor);
  }
  Body own = Block(at, {0.08, 0.06, 0.04}, BodyMotion::kFree);
  own.orientation = TurnAbout(0, 0.2);
  own.mass_kg = mass;
  own.inertia_kg_m2 = inertia;
  own.spin_rad_per_s = {1, 2, 3};
  const int free = one.AddBody(own);
  own.motion = BodyMotion::kPrescribed;
  const int linked = two.AddBody(own);
  MultibodySpec spec;
  spec.bodies = {Solid("block", mass, inertia, at)};
  spec.bodies[0].orientation = own.orientation;
  spec.bodies[0].spin_rad_per_s = own.spin_rad_per_s;
  MultibodySystem bodies(spec);
  CoupledBodies both(&two, &bodies, {{"block", linked}});
  Falls falls;
  double touched = -1;
  while (touched < 0 || two.time_s() < touched + 0.015) {
    if (one.Step() != StepFault::kNone || both.Step() != StepFault::kNone) return falls;
    falls.peak_n = std::max(falls.peak_n, two.wrench(linked).fz);
    falls.after = Norm(Sub(one.body(free).position_m, two.body(linked).position_m));
    if (touched < 0) falls.before = std::max(falls.before, falls.after);
    if (touched < 0 && two.wrench(linked).fz > 0) touched = two.time_s();
  }
  return falls;
}

TEST(Coupling, FreeBodyFallsLikeTheEnginesOwn) {
  const Falls coarse = FallOfBoth(1e-4), fine = FallOfBoth(2.5e-5);
  EXPECT_LT(coarse.before, 1e-12);          // free flight: the same leapfrog
  EXPECT_GT(coarse.peak_n, 10 * 0.6 * kG);  // they did meet
  // On the grains they turn by two schemes of second order; the difference falls with the step.
  EXPECT_LT(coarse.after, 1e-8);
  EXPECT_LT(fine.after, 0.5 * coarse.after);
}

/// Without gravity a block flies into loose grains: momentum and energy of both together stay.
TEST(Coupling, MomentumAndEnergyOfGrainsAndBodiesStay) {
  const double r = 0.02, dt = 2e-5, mass = 0.6;
  std::vector<GrainState> grains;
  for (int i = -2; i <= 2; ++i) {
    for (int j = -2; j <= 2; ++j) {
      for (int k = 0; k < 2; ++k) {
        grains.push_back({0.5 + 0.045 * i, 0.5 + 0.045 * j, 0.045 * k, r, 2500});
      }
    }
  }
  const Vec3d at = {0.5, 0.5, 0.1};
  World world(Config(dt, 0, 0.6, 0.3), grains);
  const int block = world.AddBody(Block(at, {0.08, 0.06, 0.04}, BodyMotion::kPrescribed));
  MultibodySpec spec;
  spec.gravity_m_per_s2 = {0, 0, 0};
  spec.bodies = {Solid("block", mass, {6e-4, 8e-4, 9e-4}, at)};
  spec.bodies[0].velocity_m_per_s = {0.2, 0.1, -1};
  MultibodySystem bodies(spec);
  CoupledBodies both(&world, &bodies, {{"block", block}});
  const auto momentum = [&] {
    // Of grains at the half step, as the world holds them: their present one less half a kick.
    Vec3d p = bodies.Momentum()[0];
    for (const Grain& g : world.grains()) {
      if (g.id < 0 || g.id >= static_cast<int>(grains.size())) continue;
      p = Add(p, Scale(g.mass, {g.vx, g.vy, g.vz}));
    }
    return p;
  };
  for (int s = 0; s < 3000; ++s) ASSERT_EQ(both.Step(), StepFault::kNone);
  const Vec3d p = momentum();
  EXPECT_NEAR(p[0], 0.2 * mass, 2e-6);
  EXPECT_NEAR(p[1], 0.1 * mass, 2e-6);
  EXPECT_NEAR(p[2], -1.0 * mass, 2e-6);
  EXPECT_GT(bodies.Velocity(0).velocity_m_per_s[2], -0.9);  // they did meet
  const MultibodyEnergy e = bodies.Energy();
  const double lost = 0.5 * mass * 1.05 - e.kinetic;
  EXPECT_NEAR(-e.grains, lost, 1e-3 * lost);
  EXPECT_NEAR(world.state().bodies.at(block).work_j, lost, 2e-3 * lost);
}

/// Restitution of a block on a slider that is `times` as heavy as the free grain that hits it.
double RestitutionOnBlock(double times, double restitution) {
  const double r = 0.02, grain = 4.0 / 3 * M_PI * r * r * r * 2500, dt = 1e-5;
  GrainState flying = {0.5, 0.5, r + 1e-4, r, 2500};
  flying.v_z = -0.5;
  World world(Config(dt, 0, restitution, 0), {flying});
  const Vec3d at = {0.5, 0.5, -0.05};
  const int block = world.AddBody(Block(at, {0.2, 0.2, 0.1}, BodyMotion::kPrescribed));
  MultibodySpec spec;
  spec.gravity_m_per_s2 = {0, 0, 0};
  spec.bodies = {Solid("block", times * grain, {0.01, 0.01, 0.01}, at)};
  spec.joints = {JointAt(spec, "rail", JointType::kTranslational, kGround, "block", at, {0, 0, 1})};
  MultibodySystem bodies(spec);
  CoupledBodies both(&world, &bodies, {{"block", block}});
  bool touched = false;
  for (int s = 0; s < 20000; ++s) {
    EXPECT_EQ(both.Step(), StepFault::kNone);
    touched = touched || world.wrench(block).fz < 0;
    if (touched && world.wrench(block).fz == 0) break;
  }
  return (world.State(0).v_z - bodies.Velocity(0).velocity_m_per_s[2]) / 0.5;
}

/// The damping of a contact takes the block as infinitely heavy (docs/multibody.md, limits): its
/// damping ratio is then sqrt((M + m)/M) of the one that the restitution asks for.
TEST(Coupling, ABlockThatIsLightHasLessRestitution) {
  const double e = 0.5, log_e = std::log(e);
  for (const double times : {1.0, 10.0, 1000.0}) {
    const double ratio =
        -log_e / std::sqrt(log_e * log_e + M_PI * M_PI) * std::sqrt((times + 1) / times);
    const double expected = std::exp(-M_PI * ratio / std::sqrt(1 - ratio * ratio));
    EXPECT_NEAR(RestitutionOnBlock(times, e), expected, 0.01) << times;
  }
}

TEST(Coupling, FaultyLinksAreNamed) {
  World world(Config(1e-4, -9.81, 0.5, 0.5), {{0.5, 0.5, 0, 0.02, 2500}});
  const int fixed = world.AddBody(Block({0.5, 0.5, 0.5}, {0.1, 0.1, 0.1}, BodyMotion::kFixed));
  const int moves = world.AddBody(Block({0.5, 0.5, 0.5}, {0.1, 0.1, 0.1}, BodyMotion::kPrescribed));
  MultibodySpec spec;
  spec.bodies = {Solid("block", 1, {1, 1, 1}, {0.5, 0.5, 0.5})};
  MultibodySystem bodies(spec);
  const auto said = [&](std::vector<BodyLink> links) {
    return Message([&] { CoupledBodies both(&world, &bodies, links); });
  };
  EXPECT_EQ(said({{"block", moves}}), "");
  EXPECT_NE(said({{"rod", moves}}).find("body 'rod', expected one of 'block'"), std::string::npos);
  EXPECT_NE(said({{"block", 7}}).find("world_body: 7"), std::string::npos);
  EXPECT_NE(said({{"block", fixed}}).find("kPrescribed"), std::string::npos);
  EXPECT_NE(said({{"block", moves}, {"block", moves}}).find("linked twice"), std::string::npos);
  spec.gravity_m_per_s2 = {0, 0, -1.62};
  MultibodySystem moon(spec);
  EXPECT_NE(Message([&] { CoupledBodies both(&world, &moon, {}); }).find("gravity"),
            std::string::npos);
}

}  // namespace
}  // namespace grouser::dem
