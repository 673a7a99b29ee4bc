// Stiff contact at low speed: hard ground under wheels without the inertia of motors.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/in_process/on_floor.h"
#include "tests/unit/mujoco/rover_world.h"

namespace grouser::mujoco {
namespace {

struct Drive {
  double x, fastest_late;  // [m], any velocity of the last second [m/s, rad/s]
};

/// 20 s of a start, a turn in place, a reversal and a stop.
Drive DriveOn(const Model& ground, double time_step, double relaxation_over_radius) {
  const Scene scene;
  scene.m->opt.timestep = time_step;
  for (int i = 6; i < scene.m->nv; ++i) scene.m->dof_armature[i] = 0;
  for (int i = 0; i < scene.m->nu; ++i) {  // a motor that such a wheel stands at these steps
    scene.m->actuator_gainprm[i * mjNGAIN] = 0.1;
    scene.m->actuator_biasprm[i * mjNBIAS + 2] = -0.1;
  }
  SoilContact soil(scene.m,
                   {{"wheel_*",
                     &ground,
                     {.tyre_stiffness = 2e4, .relaxation_over_radius = relaxation_over_radius}}},
                   "ground");
  const PassiveForces passive(&soil);
  World world(scene.m);
  mjData* d = world.d;
  Drive drive = {0, 0};
  while (d->time < 20) {
    const double t = d->time;
    world.DriveAround();
    mj_step(scene.m, d);
    if (t < 19) continue;
    for (int i = 0; i < scene.m->nv; ++i) {
      drive.fastest_late = std::max(drive.fastest_late, std::fabs(d->qvel[i]));
    }
  }
  drive.x = d->qpos[0];
  return drive;
}

TEST(MujocoStiff, RelaxationKeepsHardGroundStableAtOneAndTwoMilliseconds) {
  const Model floor = OnFloor(1, 1000, -2, 2);
  const Drive fine = DriveOn(floor, 0.001, 0.3), coarse = DriveOn(floor, 0.002, 0.3);
  EXPECT_NEAR(fine.x, coarse.x, 2e-3);
  EXPECT_GT(fine.x, 0.05);
  EXPECT_LT(fine.fastest_late, 0.02);
  EXPECT_LT(coarse.fastest_late, 0.02);
  // Slip at once: wheels that should stand swing with every step.
  EXPECT_GT(DriveOn(floor, 0.002, 0).fastest_late, 0.2);
}

}  // namespace
}  // namespace grouser::mujoco
