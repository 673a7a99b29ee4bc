// How much of made-up hills a vehicle drives northward, a row of cells at a time:
// map_example [VEHICLE_FILE [CELLS A SIDE]]. Exit code 1: refused, or nothing is driven.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <vector>

#include "grouser/map.h"

int main(int argc, char** argv) try {
  const auto vehicle = grouser::Vehicle::Open(argc > 1 ? argv[1] : DEFAULT_VEHICLE);
  const std::size_t side = argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 200;
  const grouser::TerrainMap map(vehicle, {.speed_limit = 0.8});
  std::vector<float> height(3 * (side + 2)), speed(side), energy(side);
  const grouser::MapCells cells{
      .rows = 1, .columns = side, .width = 2, .height = 2, .elevation = height};
  const grouser::MapWay north = grouser::MapWay::Azimuth(0);
  const grouser::MapAnswers answers{.speed = speed, .energy = energy};
  std::size_t driven = 0;
  double joules = 0;
  for (std::size_t row = 0; row < side; ++row) {
    for (std::size_t i = 0; i < height.size(); ++i) {  // the row, and its neighbours
      const double x = 0.04 * double(i % (side + 2)), y = 0.04 * double(row + i / (side + 2));
      height[i] = float(40 * std::sin(x) * std::cos(y));
    }
    if (!map.Evaluate(cells, north, answers)) {
      std::fprintf(stderr, "map_example: %s\n", map.Problem(cells, north, answers).c_str());
      return 1;
    }
    for (std::size_t c = 0; c < side; ++c) driven += speed[c] > 0;
    for (std::size_t c = 0; c < side; ++c) joules += speed[c] > 0 ? energy[c] : 0;
  }
  std::printf("%zu of %zu cells, %.0f J/m\n", driven, side * side, joules / double(driven));
  return driven > 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "map_example: %s\n", error.what());
  return 1;
}
