// A speed plan along a slalom: speed_example [VEHICLE_FILE [SPEED_LIMIT]]
// Exit code 1: refused, or a plan that does not hold.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "grouser/vehicle.h"

int main(int argc, char** argv) try {
  const auto vehicle = grouser::Vehicle::Open(argc > 1 ? argv[1] : DEFAULT_VEHICLE);
  std::vector<double> s, curvature, speed(200);
  for (int i = 0; i < 200; ++i) {
    s.push_back(0.1 * i);
    curvature.push_back(0.5 * std::sin(0.1 * i));
  }
  grouser::SpeedPlanner planner(vehicle, s.size());
  const grouser::Path path{.s = s, .curvature = curvature};
  const grouser::SpeedOptions options{.speed_limit =
                                          argc > 2 ? std::strtod(argv[2], nullptr) : 1.5};
  const grouser::SpeedPlan plan{.speed = speed};
  std::size_t not_held = 0;
  if (!planner.Plan(path, options, plan, &not_held)) {
    std::fprintf(stderr, "speed_example: %s\n", planner.Problem(path, options, plan).c_str());
    return 1;
  }
  for (std::size_t i = 0; i < 200; ++i) std::printf("%.1f m  %.3f m/s\n", s[i], speed[i]);
  return not_held == 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "speed_example: %s\n", error.what());
  return 1;
}
