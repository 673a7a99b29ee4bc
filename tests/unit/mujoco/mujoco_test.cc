// The rover of clients/mujoco on sand: forces are the model's, motion the vehicle solver's.
#include "grouser/mujoco.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>

#include "grouser/vehicle.h"
#include "tests/unit/mujoco/rover_world.h"

namespace grouser::mujoco {
namespace {

constexpr double kRadius = 0.0625;

// Also behind a callback: what the wheels' joints feel is the model's torque.
TEST(Mujoco, ForcesAreTheModelsAtTheSameSlipAngleAndLoad) {
  const Scene scene;
  const Model sand = Model::Open(kSand);
  SoilContact soil(scene.m, {{"wheel_*", &sand, {.relaxation_over_radius = 0}}}, "ground");
  World world(scene.m);
  world.Roll(0.03, 0.09);
  for (int i = 0; i < 1500; ++i) world.Step(&soil);
  mjData* d = world.d;
  mj_step1(scene.m, d);
  soil.Apply(scene.m, d);
  ASSERT_EQ(soil.names()[1], "wheel_front_right");
  double force[3] = {0, 0, 0};
  for (int w = 0; w < 4; ++w) {
    const WheelForce& f = soil.forces()[w];
    // The motion by MuJoCo's Jacobian, the contact frame from the body's own axes.
    const int body = mj_name2id(scene.m, mjOBJ_BODY, soil.names()[w].c_str());
    std::vector<double> jacobian(3 * scene.m->nv);
    mj_jacBody(scene.m, d, jacobian.data(), nullptr, body);
    double v[3], axle[3];
    mju_mulMatVec(v, jacobian.data(), d->qvel, 3, scene.m->nv);
    for (int k = 0; k < 3; ++k) axle[k] = d->xmat[9 * body + 3 * k + 1];
    const double flat = std::hypot(axle[0], axle[1]);
    const double x[2] = {axle[1] / flat, -axle[0] / flat};
    const double v_x = x[0] * v[0] + x[1] * v[1], v_y = -x[1] * v[0] + x[0] * v[1];
    double spin[6];
    mj_objectVelocity(scene.m, d, mjOBJ_BODY, body, spin, 0);
    const double rim = kRadius * mju_dot3(axle, spin);
    EXPECT_NEAR(f.v_x, v_x, 1e-12);
    EXPECT_NEAR(f.v_y, v_y, 1e-12);
    EXPECT_NEAR(f.rim_speed, rim, 1e-12);
    const Answer a = sand.Evaluate(State{f.v_x, f.v_y, f.rim_speed, f.load});
    const double f_x = a.output[kFx].value, f_y = a.output[kFy].value;
    EXPECT_NEAR(f.force[0], x[0] * f_x - x[1] * f_y, 1e-12);
    EXPECT_NEAR(f.force[1], x[1] * f_x + x[0] * f_y, 1e-12);
    EXPECT_NEAR(f.force[2], f.load, 1e-12);
    EXPECT_NEAR(f.torque, a.output[kTorque].value, 1e-12);
    EXPECT_GT(f.load, 5);
    EXPECT_GT(std::fabs(f_y), 0.1);
    for (int k = 0; k < 3; ++k) force[k] += f.force[k];
    const int joint = scene.m->jnt_dofadr[scene.m->body_jntadr[body]];
    EXPECT_NEAR(d->qfrc_passive[joint], mju_dot3(f.moment.data(), axle), 1e-12);
  }
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(d->qfrc_passive[k], force[k], 1e-11);
}

// What was before the first Apply, or a reset, is no travel, whatever the time.
TEST(Mujoco, AFirstStepAtALaterTimeIsAFirstStep) {
  const Scene scene(
      Changed("<actuator>", "<keyframe><key name=\"later\" time=\"5\"/></keyframe><actuator>"));
  const Model sand = Model::Open(kSand);
  SoilContact soil(scene.m, {{"wheel_*", &sand}}, "ground");
  World world(scene.m);
  const auto first_force = [&] {
    world.d->qvel[0] = 0.1;
    mj_step1(scene.m, world.d);
    soil.Apply(scene.m, world.d);
    return soil.forces()[0];
  };
  const WheelForce at_start = first_force();
  ASSERT_LT(at_start.mobilised, 0.9);
  ASSERT_NE(at_start.f_x, 0);
  for (int again = 0; again < 2; ++again) {
    mj_resetDataKeyframe(scene.m, world.d, 0);
    ASSERT_EQ(world.d->time, 5);
    const WheelForce later = first_force();
    EXPECT_EQ(later.f_x, at_start.f_x);
    EXPECT_EQ(later.mobilised, at_start.mobilised);
  }
  world.d->time = 4.5;  // back, after a step at 5 s
  EXPECT_EQ(first_force().f_x, at_start.f_x);
}

TEST(Mujoco, ManyWorldsInOneBatchAreThoseOneByOne) {
  const Scene scene;
  const Model sand = Model::Open(kSand);
  SoilContact batch(scene.m, {{"wheel_*", &sand}}, "ground");
  SoilContact single(scene.m, {{"wheel_*", &sand}}, "ground");
  std::vector<std::unique_ptr<World>> together, alone;
  std::vector<mjData*> worlds;
  for (int i = 0; i < 17; ++i) {
    for (auto* all : {&together, &alone}) {
      all->push_back(std::make_unique<World>(scene.m));
      all->back()->Drive(0.01 * i, 0.1 - 0.005 * i);
    }
    worlds.push_back(together.back()->d);
  }
  for (int step = 0; step < 300; ++step) {
    for (mjData* d : worlds) mj_step1(scene.m, d);
    batch.Apply(scene.m, worlds);
    for (mjData* d : worlds) mj_step2(scene.m, d);
  }
  const PassiveForces passive(&single);  // from within mj_step
  for (auto& world : alone) {
    for (int step = 0; step < 300; ++step) mj_step(scene.m, world->d);
  }
  for (std::size_t i = 0; i < worlds.size(); ++i) {
    EXPECT_EQ(std::memcmp(worlds[i]->qpos, alone[i]->d->qpos, scene.m->nq * sizeof(double)), 0);
    EXPECT_GT(std::fabs(worlds[i]->qpos[0]), 1e-3);
  }
}

// Steady motions at the rim speeds that MuJoCo's motors reach. Speeds and power of the solver are
// to 1e-6; MuJoCo's loads are those of soil under a rigid body that leans, the solver's of springs,
// which shifts some tenths of a newton between the axles.
TEST(Mujoco, DrivesAsTheVehicleSolverSays) {
  const Scene scene;
  const Model sand = Model::Open(kSand);
  SoilContact soil(scene.m, {{"wheel_*", &sand}}, "ground");
  const Vehicle vehicle = Vehicle::Open(GROUSER_MUJOCO "/rover.vehicle.yaml");
  VehicleSolver solver(vehicle);
  const double asked[][2] = {{0.06, 0.06}, {0.09, 0.09}, {0.07, 0.09}, {0.05, 0.1}};
  for (const auto& rims : asked) {
    World world(scene.m);
    world.Roll(rims[0], rims[1]);
    double forward = 0, yaw_rate = 0, power = 0, rim[2] = {0, 0};
    const int settle = 4000, mean = 1000;
    for (int i = 0; i < settle + mean; ++i) {
      world.Step(&soil);
      if (i < settle) continue;
      const double* v = world.d->qvel;
      const double* q = world.d->qpos;
      const double yaw = 2 * std::atan2(q[6], q[3]);
      forward += (std::cos(yaw) * v[0] + std::sin(yaw) * v[1]) / mean;
      yaw_rate += v[5] / mean;
      for (int w = 0; w < 4; ++w) {
        rim[w % 2] += 0.5 * kRadius * v[6 + w] / mean;
        power += world.d->actuator_force[w] * v[6 + w] / mean;
      }
    }
    std::vector<std::uint32_t> reasons(1);
    std::vector<double> v_x(1), yaw(1), shaft(1);
    Solutions out;
    out.reasons = reasons;
    out.v_x = v_x;
    out.yaw_rate = yaw;
    out.shaft_power = shaft;
    ASSERT_TRUE(solver.Solve({.rim_speed = rim}, out)) << solver.Problem({.rim_speed = rim}, out);
    std::printf(
        "rims %.4f %.4f m/s: MuJoCo %.4f m/s %.4f rad/s %.4f W; solver %.4f %.4f %.4f (%s)\n",
        rim[0], rim[1], forward, yaw_rate, power, v_x[0], yaw[0], shaft[0],
        NamesOfReasons(reasons[0]).c_str());
    EXPECT_EQ(reasons[0] & kNoBalance, 0u);
    EXPECT_NEAR(forward, v_x[0], 0.005 * v_x[0]);
    EXPECT_NEAR(yaw_rate, yaw[0], 0.01 * std::fabs(yaw[0]) + 1e-5);
    EXPECT_NEAR(power, shaft[0], 0.005 * shaft[0]);
  }
}

TEST(Mujoco, MirrorsLeftAndRight) {
  const Scene scene;
  const Model sand = Model::Open(kSand);
  SoilContact soil(scene.m, {{"wheel_*", &sand}}, "ground");
  World left(scene.m), right(scene.m);
  left.Roll(0.03, 0.09);
  right.Roll(0.09, 0.03);
  for (int i = 0; i < 2000; ++i) {
    left.Step(&soil);
    right.Step(&soil);
  }
  const double *a = left.d->qpos, *b = right.d->qpos;
  EXPECT_NEAR(a[0], b[0], 1e-6);
  EXPECT_NEAR(a[1], -b[1], 1e-6);
  EXPECT_NEAR(a[2], b[2], 1e-6);
  EXPECT_NEAR(a[6], -b[6], 1e-6);
  EXPECT_GT(std::fabs(a[6]), 0.02);
}

// Twenty seconds of starts, turns in place, reversals and stops: bounded, energy accounted for, the
// same at half the step.
TEST(Mujoco, StaysBoundedAndAccountsForItsEnergyAtOneAndTwoMilliseconds) {
  const Model sand = Model::Open(kSand);
  double way[2], used[2];
  for (int run = 0; run < 2; ++run) {
    const Scene scene;
    scene.m->opt.timestep = run == 0 ? 0.002 : 0.001;
    SoilContact soil(scene.m, {{"wheel_*", &sand}}, "ground");
    const PassiveForces passive(&soil);
    World world(scene.m);
    mjData* d = world.d;
    const double start = world.Energy();
    double motors = 0, ground = 0, fastest = 0;
    std::vector<double> mean(scene.m->nv);
    while (d->time < 20) {
      world.DriveAround();
      mju_copy(mean.data(), d->qvel, scene.m->nv);
      mj_step(scene.m, d);
      mju_addTo(mean.data(), d->qvel, scene.m->nv);
      const double half = 0.5 * scene.m->opt.timestep;
      motors += half * mju_dot(d->qfrc_actuator, mean.data(), scene.m->nv);
      ground -= half * mju_dot(d->qfrc_passive, mean.data(), scene.m->nv);
      fastest = std::max(fastest, world.speed());
      ASSERT_LT(std::fabs(d->qpos[2]), 0.2) << d->time;
    }
    EXPECT_LT(fastest, 0.2);
    EXPECT_LT(world.speed(), 2e-3);  // it stands
    const double rest = motors - ground - (world.Energy() - start);
    std::printf("step %.3f s: motors %.4f J, to the soil %.4f J, rest %.5f J (%.3f %%)\n",
                scene.m->opt.timestep, motors, ground, rest, 100 * rest / motors);
    EXPECT_LT(std::fabs(rest), 1e-3 * motors);
    EXPECT_GT(motors, 2);
    way[run] = d->qpos[0];
    used[run] = motors;
  }
  EXPECT_NEAR(way[0], way[1], 0.02);
  EXPECT_NEAR(used[0], used[1], 0.02 * used[1]);
}

// Locked wheels on a slope: below what the model holds they stand, above they slide.
TEST(Mujoco, StandsOnASlopeOrSlidesAsTheModelSays) {
  const Model sand = Model::Open(kSand);
  for (const double degrees : {8.0, 50.0}) {
    const Scene scene;
    const double slope = degrees * mjPI / 180;
    // Gravity leans instead of the ground: the same, and the ground is level for the check below.
    scene.m->opt.gravity[0] = -9.81 * std::sin(slope);
    scene.m->opt.gravity[2] = -9.81 * std::cos(slope);
    for (int j = 1; j < scene.m->njnt; ++j) {  // brakes
      scene.m->jnt_stiffness[j] = 500;
      scene.m->dof_damping[scene.m->jnt_dofadr[j]] = 5;
    }
    SoilContact soil(scene.m, {{"wheel_*", &sand}}, "ground");
    const PassiveForces passive(&soil);
    World world(scene.m);
    mjData* d = world.d;
    double held = 0;  // what the model holds of a wheel that slides locked, at these loads
    std::uint32_t flags = ~0u;
    while (d->time < 10 && d->qpos[0] > -1) {
      mj_step(scene.m, d);
      held = 0;
      for (const WheelForce& f : soil.forces()) {
        held += sand.Evaluate(State{-0.05, 0, 0, f.load}).output[kFx].value;
        flags &= f.flags;
      }
    }
    EXPECT_NE(flags & kSlope, 0u);
    const double asked = 4.9 * 9.81 * std::sin(slope);
    std::printf(
        "%.0f deg: asked %.1f N, held at most %.1f N, at %.4f m/s after 10 s, %.3f m down\n",
        degrees, asked, held, world.speed(), -d->qpos[0]);
    ASSERT_TRUE(degrees < 20 ? asked < held : asked > held);  // else the angle is ill chosen
    if (asked < held) {
      EXPECT_LT(world.speed(), 2e-3);
      EXPECT_LT(std::fabs(d->qpos[0]), 0.05);
    } else {
      EXPECT_LE(d->qpos[0], -1);
    }
  }
}

TEST(Mujoco, AHeightFieldThatLeansIsThePlaneThatLeans) {
  const Model sand = Model::Open(kSand);
  const Scene scene;
  const double slope = 0.1;
  for (int i = 0; i < scene.m->nhfielddata; ++i) {  // 0.2 high in all
    scene.m->hfield_data[i] = static_cast<float>((0.05 * (i % 141) * slope * 0.25 + 0.02) / 0.2);
  }
  SoilContact soil(scene.m, {{"wheel_*", &sand}}, "ground");
  World world(scene.m);
  mjData* d = world.d;
  d->qpos[0] = 0.33;
  d->qpos[2] = (3.5 + 0.33) * slope * 0.25 + 0.02 + 0.05;
  d->qvel[0] = 0.05;
  mj_step1(scene.m, d);
  soil.Apply(scene.m, d);
  const double n_x = -0.025 / std::hypot(1, 0.025), n_z = 1 / std::hypot(1, 0.025);
  WheelContact contact(sand);
  for (int w = 0; w < 4; ++w) {
    const double x = 0.33 + (w < 2 ? 0.15 : -0.15);
    WheelMotion motion;
    motion.centre = {x, w % 2 == 0 ? 0.2 : -0.2, d->qpos[2]};
    motion.axle = {0, 1, 0};
    motion.velocity = {0.05, 0, 0};
    motion.ground_point = {0, 0, 3.5 * slope * 0.25 + 0.02};
    motion.ground_normal = {n_x, 0, n_z};
    ContactState state;
    const WheelForce f = contact.Evaluate(motion, &state);
    EXPECT_GT(f.load, 1);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(soil.forces()[w].force[k], f.force[k], 2e-3 * f.load);
    EXPECT_NEAR(soil.forces()[w].sinkage, f.sinkage, 1e-6);
    EXPECT_NE(soil.forces()[w].flags & kSlope, 0u);
  }
  d->qpos[0] = 4;  // beyond the edge
  mj_step1(scene.m, d);
  soil.Apply(scene.m, d);
  for (const WheelForce& f : soil.forces()) EXPECT_EQ(f.flags, kAirborne);
}

TEST(Mujoco, CopiesAndResetsCarryWhatWheelsRemember) {
  const Scene scene;
  const Model sand = Model::Open(kSand);
  SoilContact soil(scene.m, {{"wheel_*", &sand}}, "ground");
  const PassiveForces passive(&soil);
  World world(scene.m), copy(scene.m), fresh(scene.m);
  world.Drive(0.05, 0.08);
  fresh.Drive(0.05, 0.08);
  for (int i = 0; i < 400; ++i) mj_step(scene.m, world.d);
  mj_copyData(copy.d, scene.m, world.d);
  for (int i = 0; i < 100; ++i) mj_step(scene.m, world.d);
  for (int i = 0; i < 100; ++i) mj_step(scene.m, copy.d);
  EXPECT_EQ(std::memcmp(world.d->qpos, copy.d->qpos, scene.m->nq * sizeof(double)), 0);
  mj_resetData(scene.m, world.d);
  world.Drive(0.05, 0.08);
  for (int i = 0; i < 100; ++i) mj_step(scene.m, world.d);
  for (int i = 0; i < 100; ++i) mj_step(scene.m, fresh.d);
  EXPECT_EQ(std::memcmp(world.d->qpos, fresh.d->qpos, scene.m->nq * sizeof(double)), 0);
  EXPECT_NE(world.d->userdata[1], 0);
}

}  // namespace
}  // namespace grouser::mujoco
