// A quarter of a vehicle on the FMU at 1 ms, integrated by the host (semi-implicit Euler).
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/fmi/fmu_fixture.h"

namespace grouser::fmi::testing {
namespace {

struct Host {
  Fmu wheel;
  double radius, mass = 1.2, inertia;
  // One step late: hosts that hand over the forces of the last communication point.
  bool late = false;
  double motor = 0, wanted_spin = 0;  // gain [N m s], spin [rad/s]
  double x = 0, z = 0, v_x = 0, v_y = 0, v_z = 0, spin = 0, turned = 0, time = 0;
  double work = 0;  // of the motor [J]
  std::array<double, 3> force{}, moment{};

  explicit Host(const char* folder, bool is_late = false) : wheel(kFmus / folder), late(is_late) {
    wheel.Initialize();
    radius = wheel.Get("wheel_radius");
    inertia = 0.5 * 0.3 * radius * radius;
    z = radius + 0.01;
  }

  void Step(double dt) {
    const std::array<double, 3> before = force, turn = moment;
    wheel.Set("wheel_state.pos.x", x);
    wheel.Set("wheel_state.pos.z", z);
    wheel.Set("wheel_state.rot.e0", std::cos(turned / 2));
    wheel.Set("wheel_state.rot.e2", std::sin(turned / 2));
    wheel.Set("wheel_state.lin_vel.x", v_x);
    wheel.Set("wheel_state.lin_vel.y", v_y);
    wheel.Set("wheel_state.lin_vel.z", v_z);
    wheel.Set("wheel_state.ang_vel.y", spin);
    wheel.Step(time, dt);
    wheel.Get(wheel.References("wheel_load.force"), force);
    wheel.Get(wheel.References("wheel_load.moment"), moment);
    const auto& f = late ? before : force;
    const auto& m = late ? turn : moment;
    const double torque = motor * (wanted_spin - spin);
    v_x += dt * f[0] / mass;
    v_y += dt * f[1] / mass;
    v_z += dt * (f[2] / mass - 9.81);
    spin += dt * (torque + m[1]) / inertia;
    work += dt * torque * spin;
    x += dt * v_x;
    z += dt * v_z;
    turned += dt * spin;
    time += dt;
  }
  void Run(double seconds) {
    for (const double end = time + seconds; time < end - 5e-4;) Step(1e-3);
  }
  double Energy() const {
    return 0.5 * mass * (v_x * v_x + v_y * v_y + v_z * v_z) + 0.5 * inertia * spin * spin +
           mass * 9.81 * z;
  }
};

class FmuDrive : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Hosts, FmuDrive, ::testing::Values(false, true),
                         [](const auto& p) { return p.param ? "Late" : "AtOnce"; });

TEST_P(FmuDrive, DropsSettlesAndStands) {
  Host host("fmi3", GetParam());
  const double dropped = host.Energy();
  host.Run(2);
  const double load = host.wheel.Get("contact.load");
  EXPECT_NEAR(load, host.mass * 9.81, 0.01 * load);
  EXPECT_LT(std::fabs(host.v_z), 1e-3);
  const double settled = host.Energy();
  EXPECT_LT(settled, dropped);
  double highest = settled;
  for (int i = 0; i < 30; ++i) {
    host.Run(0.1);
    highest = std::max(highest, host.Energy());
  }
  EXPECT_LE(highest, settled + 1e-6 * dropped);
}

// Thrown forward and sideways, wheel free. Shear that has built up gives back what it holds as a
// spring does: the wheel swings, each second with less than 0.3 of the highest kinetic energy of
// the second before, and the highest energy of a second never rises.
TEST_P(FmuDrive, RollsOutWithoutGainingEnergy) {
  Host host("fmi3", GetParam());
  host.v_x = 0.3;
  host.v_y = 0.1;
  host.spin = 0.3 / host.radius;
  double highest = host.Energy(), fastest = highest - host.mass * 9.81 * host.z;
  ASSERT_GT(fastest, 0.05);  // [J]
  for (int second = 0; second < 8; ++second) {
    double highest_now = 0, fastest_now = 0;
    for (int i = 0; i < 1000; ++i) {
      host.Step(1e-3);
      highest_now = std::max(highest_now, host.Energy());
      fastest_now = std::max(fastest_now, host.Energy() - host.mass * 9.81 * host.z);
    }
    EXPECT_LE(highest_now, highest) << second;
    if (second > 0) {  // which has the drop
      EXPECT_LT(fastest_now, 0.3 * fastest) << second;
    }
    highest = highest_now;
    fastest = fastest_now;
  }
}

// It starts rolling, the hub at the rim's speed: from rest, a wheel that is driven at once slips by
// almost 1, where the model of a loose sand may have no pull: a second equilibrium, on the spot.
TEST_P(FmuDrive, DrivesSteadily) {
  Host host("fmi3", GetParam());
  host.motor = 1;
  host.wanted_spin = 0.1 / host.radius;
  host.v_x = 0.1;
  host.spin = host.wanted_spin;
  const double start = host.Energy();
  host.Run(4);
  const double speed = host.v_x, load = host.wheel.Get("contact.load");
  EXPECT_GT(speed, 0.05);
  EXPECT_LT(speed, 0.1);
  EXPECT_NEAR(load, host.mass * 9.81, 0.01 * load);
  double slowest = speed, fastest = speed;
  for (int i = 0; i < 2000; ++i) {
    host.Step(1e-3);
    slowest = std::min(slowest, host.v_x);
    fastest = std::max(fastest, host.v_x);
  }
  EXPECT_LT(fastest - slowest, 0.01 * speed);
  EXPECT_NEAR(host.wheel.Get("contact.f_x"), 0, 0.02 * load);  // nothing is pulled
  EXPECT_LT(host.Energy(), host.work + start + host.mass * 9.81 * 0.001);
}

}  // namespace
}  // namespace grouser::fmi::testing
