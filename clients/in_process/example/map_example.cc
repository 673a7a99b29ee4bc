// How much of made-up hills a vehicle drives northward, and the mean energy of that:
// map_example [VEHICLE_FILE [CELLS A SIDE]]. Exit code 1: refused.
#include <cmath>
#include <cstdio>

#include "grouser/map.h"

int main(int argc, char** argv) try {
  const grouser::TerrainMap map(grouser::Vehicle::Open(argc > 1 ? argv[1] : DEFAULT_VEHICLE));
  const std::size_t side = argc > 2 ? std::stoul(argv[2]) : 200;
  std::vector<float> height(side * side), speed(side * side), energy(side * side);
  for (std::size_t i = 0; i < height.size(); ++i)
    height[i] = 40 * std::sin(0.04F * float(i % side)) * std::cos(0.04F * float(i / side));
  const grouser::MapCells cells{.rows = side, .columns = side, .width = 2, .elevation = height};
  const grouser::MapAnswers answers{.speed = speed, .energy = energy};
  if (!map.Evaluate(cells, answers)) throw std::invalid_argument(map.Problem(cells, answers));
  double driven = 0, joules = 0;
  for (std::size_t i = 0; i < speed.size(); ++i)
    if (speed[i] > 0) driven += 1, joules += energy[i];
  std::printf("%.0f of %zu cells, %.0f J/m\n", driven, speed.size(), joules / driven);
} catch (const std::exception& error) {
  std::fprintf(stderr, "map_example: %s\n", error.what());
  return 1;
}
