// A quarter of a vehicle drops onto soil, rolling, and drives on: fmu_example FOLDER [SECONDS]
// FOLDER: an FMU that was unpacked. The host is this program: masses, motor, integration at 1 ms.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "clients/fmi/loader/fmu.h"

int main(int argc, char** argv) try {
  if (argc < 2) throw std::runtime_error("expected the folder of an unpacked FMU");
  grouser::fmi::Fmu wheel(argv[1]);
  wheel.Initialize();
  const double radius = wheel.Get("wheel_radius"), dt = 1e-3, gravity = 9.81;
  const double mass = 1.2, inertia = 0.5 * 0.3 * radius * radius;  // of the wheel 0.3 kg
  const double wanted_spin = 0.1 / radius, end = argc > 2 ? std::atof(argv[2]) : 5;
  // It starts rolling, the hub at the rim's speed: from rest, a wheel that is driven at once slips
  // by almost 1, where the model of a loose sand may have no pull, and it would spin on the spot.
  double x = 0, z = radius + 0.01, v_x = 0.1, v_z = 0, spin = wanted_spin, turned = 0;
  for (int i = 0; i * dt < end; ++i) {
    wheel.Set("wheel_state.pos.x", x);
    wheel.Set("wheel_state.pos.z", z);
    wheel.Set("wheel_state.rot.e0", std::cos(turned / 2));
    wheel.Set("wheel_state.rot.e2", std::sin(turned / 2));
    wheel.Set("wheel_state.lin_vel.x", v_x);
    wheel.Set("wheel_state.lin_vel.z", v_z);
    wheel.Set("wheel_state.ang_vel.y", spin);
    wheel.Step(i * dt, dt);
    const double motor = wanted_spin - spin;  // [N m]
    v_x += dt * wheel.Get("wheel_load.force.x") / mass;
    v_z += dt * (wheel.Get("wheel_load.force.z") / mass - gravity);
    spin += dt * (motor + wheel.Get("wheel_load.moment.y")) / inertia;
    x += dt * v_x;
    z += dt * v_z;
    turned += dt * spin;
    if (i % 500 == 499) {
      std::printf(
          "%.1f s: %.4f m/s, slip %.3f, load %.2f N, sinkage %.1f mm, pull %.2f +- %.2f N%s\n",
          (i + 1) * dt, v_x, wheel.Get("contact.slip"), wheel.Get("contact.load"),
          1e3 * wheel.Get("contact.sinkage"), wheel.Get("contact.f_x"), wheel.Get("half_width.f_x"),
          wheel.Get("extrapolated") != 0 ? ", extrapolated" : "");
    }
  }
  return std::isfinite(v_x) ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "fmu_example: %s\n", error.what());
  return 1;
}
