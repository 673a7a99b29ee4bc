// grouser-engine-bench: settles a bed, runs one wheel test, prints rates.
// Plain program: builds on a machine that has nothing but a compiler.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "dem_offline/engine/rig/wheel_test.h"

int main(int argc, char** argv) {
  grouser::dem::WheelTestSpec spec;
  const double d = argc > 1 ? std::atof(argv[1]) : 0.009;
  spec.state.slip = argc > 2 ? std::atof(argv[2]) : 0.3;
  spec.state.attack_angle_rad = argc > 3 ? std::atof(argv[3]) * 3.14159265358979 / 180 : 0.0;
  spec.rig.max_time_s = argc > 4 ? std::atof(argv[4]) : 2.0;
  spec.soil.youngs_modulus_pa = 5e6;
  spec.soil.rolling_friction = 0.2;
  spec.wheel.friction = 0.5;
  spec.soil.sizes = {{0.9 * d, 0.3}, {d, 0.4}, {1.1 * d, 0.3}};
  const auto now = [] { return std::chrono::steady_clock::now(); };
  const auto t0 = now();
  const auto tile = grouser::dem::PrepareTile(spec, [](double f, const std::string& s) {
    static std::string last;
    if (s != last || f > 0.999) std::fprintf(stderr, "%s %.2f\n", s.c_str(), f);
    last = s;
    return true;
  });
  std::printf("\ntile: %zu grains, fraction %.4f, coordination %.2f, mu %.3f, p99 %.4f, %.1f s\n",
              tile.radius_m.size(), tile.solid_fraction, tile.coordination,
              tile.preparation_friction, tile.overlap_p99_over_radius,
              std::chrono::duration<double>(now() - t0).count());
  const auto r = grouser::dem::RunWheelTest(spec, tile, nullptr);
  std::printf("status %d %s; %.1f s, %.3g particle-steps/s (%s), dt %.3g, rebuilds %lu\n",
              static_cast<int>(r.status), r.reason.c_str(), r.wall_s, r.particle_steps / r.wall_s,
              grouser::dem::EngineIsa(), r.dt_s, static_cast<unsigned long>(r.list_rebuilds));
  for (const auto& o : r.outputs) {
    std::printf("  %-8s %10.5f +- %.5f drift %.5f fluct %.4f\n", o.name.c_str(), o.mean,
                o.standard_error, o.drift, o.fluctuation);
  }
  std::printf("window %.2f..%.2f s travel %.3f I %.4f overlaps %.4f %.4f %.4f\n", r.window_start_s,
              r.window_end_s, r.travel_m, r.inertial_number, r.overlap_mean_over_radius,
              r.overlap_p99_over_radius, r.overlap_max_over_radius);
  const auto& e = r.energy;
  std::printf("energy in %.5f kin %.5f pot %.5f el %.5f nd %.5f td %.5f slip %.5f roll %.5f res %.5f\n",
              e.input_j, e.kinetic_j, e.potential_j, e.elastic_j, e.normal_damping_j,
              e.tangential_damping_j, e.slip_j, e.rolling_j, e.residual_j);
  std::printf("entry %.1f exit %.1f deg\n", r.stress.entry_angle_rad * 57.3, r.stress.exit_angle_rad * 57.3);
  for (const auto& c : r.rules) std::printf("  %s %s: %.3f (limit %.3f)\n", c.kept ? "ok " : "BAD", c.name.c_str(), c.value, c.limit);
  return 0;
}
