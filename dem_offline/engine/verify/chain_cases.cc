// A solitary wave in a chain of beads.
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {
namespace {

/// Nesterenko, J. Appl. Mech. Tech. Phys. 24 (1983) 733: in terms of the peak
/// bead velocity V the wave runs at (6/(5 pi rho theta))^(2/5) V^(1/5),
/// theta = 3 (1 - nu^2)/(4 E).
void Nesterenko(Rows& rows) {
  const int n = 60, first = 20, last = 45;
  const double r = 0.005, density = 7780, e = 203e9, nu = 0.3, dt = 2e-8;
  std::vector<GrainState> beads;
  for (int i = 0; i < n; ++i) {
    beads.push_back({0.25, 0.25, -0.3 + 2 * r * i, r, density, 0, 0, i == 0 ? 1.0 : 0.0});
  }
  World world(Cell(Model({}, {e, nu}, {.restitution = 1, .friction = 0}), 0.5, dt), beads);
  std::vector<double> peak(n, 0), at(n, 0);
  std::vector<double> before(n, 0), now(n, 0);
  while (world.StateOf(last).v_z < 0.3 || now[last] > before[last] || peak[last] == 0) {
    RunOrThrow(world, 1);
    before = now;
    for (int i = 0; i < n; ++i) {
      now[i] = world.StateOf(i).v_z;
      if (now[i] > peak[i]) peak[i] = now[i], at[i] = world.time_s();
    }
    if (world.time_s() > 5e-3) throw std::runtime_error("the wave never came");
  }
  double mean = 0;
  for (int i = first; i <= last; ++i) mean += peak[i] / (last - first + 1);
  const double theta = 3 * (1 - nu * nu) / (4 * e);
  const double expected = std::pow(6 / (5 * M_PI * density * theta), 0.4) * std::pow(mean, 0.2);
  rows.Relative("wave speed [m/s]", expected, 2 * r * (last - first) / (at[last] - at[first]), 0.01,
                "Nesterenko 1983");
  rows.Relative("peak bead velocity [m/s]", 0.68, mean, 0.02,
                "peak speed behind the front, about 0.68");
  rows.Relative("peak velocity, bead 45 over bead 20 [-]", 1, peak[last] / peak[first], 0.005,
                "a soliton keeps its height");
}

}  // namespace

Cases ChainCases() { return {{"bead_chain", Level::kQuick, Nesterenko}}; }

}  // namespace grouser::dem::verify
