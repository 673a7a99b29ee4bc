// Joules per metre of a vehicle by radius of the path: energy_example [VEHICLE_FILE [SDS]]
// SDS: standard deviations of the ground that the interval spans each way. Exit code 1: refused.
#include <cstdio>
#include <cstdlib>

#include "grouser/vehicle.h"

int main(int argc, char** argv) try {
  const auto vehicle = grouser::Vehicle::Open(argc > 1 ? argv[1] : DEFAULT_VEHICLE);
  const std::vector<double> radius = {0.5, 1, 2, 5, 100}, speed(5, 0.5);
  std::vector<double> yaw_rate, mean(5), low(5), high(5);
  for (const double r : radius) yaw_rate.push_back(0.5 / r);
  std::vector<std::uint32_t> reasons(5);
  grouser::VehicleSolver solver(vehicle);
  const grouser::Motions motions{.v_x = speed, .yaw_rate = yaw_rate};
  const grouser::Powers powers{.reasons = reasons,
                               .joules_per_metre = mean,
                               .joules_per_metre_low = low,
                               .joules_per_metre_high = high};
  const double sds = argc > 2 ? std::strtod(argv[2], nullptr) : grouser::kWorseBySd;
  if (!solver.Energy(motions, powers, sds)) {
    std::fprintf(stderr, "energy_example: %s\n", solver.Problem(motions, powers, sds).c_str());
    return 1;
  }
  for (std::size_t i = 0; i < 5; ++i)
    std::printf("radius %5.1f m: %7.2f J/m (90 %%: %.2f to %.2f)\n", radius[i], mean[i], low[i],
                high[i]);
} catch (const std::exception& error) {
  std::fprintf(stderr, "energy_example: %s\n", error.what());
  return 1;
}
