// A skid-steered rover drives, turns and climbs on sand, without a window: mujoco_rover > rover.csv
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "grouser/mujoco.h"

int main() try {
  char error[500];
  mjModel* m = mj_loadXML(ROVER, nullptr, error, sizeof error);
  if (m == nullptr) throw std::runtime_error(error);
  m->opt.enableflags |= mjENBL_ENERGY;
  for (int i = 0; i < m->nhfielddata;
       ++i) {  // level, and 80 mm up from 0.8 to 2.3 m off the middle
    const double x = 0.05 * (i % 141) - 3.5, y = 0.05 * (i / 141) - 3.5;
    const double up = std::fmin(std::fmax((std::hypot(x, y) - 0.8) / 1.5, 0), 1);
    m->hfield_data[i] = static_cast<float>(0.08 * (1 - std::cos(up * mjPI)) / 2 / 0.2);
  }
  const grouser::Model sand = grouser::Model::Open(SAND);
  grouser::mujoco::SoilContact soil(m, {{"wheel_*", &sand}}, "ground");
  const grouser::mujoco::PassiveForces passive(&soil);
  mjData* d = mj_makeData(m);
  // It starts rolling, hubs at the speed of the rims: from rest, wheels that are driven at once
  // slip by almost 1, where the model of a loose sand may have no pull, and they would spin on the
  // spot.
  constexpr double kSpeed = 0.09, kRadius = 0.0625;  // [m/s, m]
  d->qvel[0] = kSpeed;
  for (int i = 0; i < 4; ++i) d->qvel[6 + i] = kSpeed / kRadius;
  mj_forward(m, d);
  const double start = d->energy[0] + d->energy[1];
  double motors = 0, ground = 0, mean[10], rest = 0;  // joints: 6 of the chassis, 4 of the wheels
  std::puts(
      "time_s,x_m,y_m,z_m,yaw_deg,speed_m_per_s,motors_j,kinetic_j,potential_j,soil_j,rest_j");
  for (int step = 0;; ++step) {
    if (step % 50 == 0) {
      mj_forward(m, d);  // energies of now
      const double* q = d->qpos;
      const double yaw =
          std::atan2(2 * (q[3] * q[6] + q[4] * q[5]), 1 - 2 * (q[5] * q[5] + q[6] * q[6]));
      rest = motors - ground - (d->energy[0] + d->energy[1] - start);
      std::printf("%.2f,%.4f,%.4f,%.4f,%.2f,%.5f,%.5f,%.5f,%.5f,%.5f,%.6f\n", d->time, q[0], q[1],
                  q[2], yaw * 180 / mjPI, std::hypot(d->qvel[0], d->qvel[1]), motors, d->energy[1],
                  d->energy[0], ground, rest);
    }
    if (step == 20000) break;
    const double turn = d->time > 4 && d->time < 12 ? 0.5 : 0;
    for (int i = 0; i < 4; ++i)  // left, right, left, right [rad/s]
      d->ctrl[i] = (i % 2 == 0 ? 1 - turn : 1 + turn) * kSpeed / kRadius;
    mju_copy(mean, d->qvel, m->nv);
    mj_step(m, d);
    // Work of the forces of this step along its way: the mean of both velocities, times the time.
    mju_addTo(mean, d->qvel, m->nv);
    motors += 0.5 * m->opt.timestep * mju_dot(d->qfrc_actuator, mean, m->nv);
    ground -= 0.5 * m->opt.timestep * mju_dot(d->qfrc_passive, mean, m->nv);
  }
  std::fprintf(stderr,
               "motors %.3f J = energy %+.3f J + to the soil %.3f J + rest %.4f J (%.2f %%)\n",
               motors, d->energy[0] + d->energy[1] - start, ground, rest, 100 * rest / motors);
  mj_deleteData(d);
  mj_deleteModel(m);
} catch (const std::exception& error) {
  std::fprintf(stderr, "mujoco_rover: %s\n", error.what());
  return 1;
}
