// Long runs: what rests must rest, what is kept must be kept.
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

double Farthest(const World& world, const std::vector<GrainState>& from) {
  double worst = 0;
  for (std::int32_t id = 0; id < world.count(); ++id) {
    const GrainState g = world.StateOf(id), &o = from[id];
    worst = std::max(worst, std::hypot(g.x_m - o.x_m, g.y_m - o.y_m, g.z_m - o.z_m) / g.radius_m);
  }
  return worst;
}

std::vector<GrainState> States(const World& world) {
  std::vector<GrainState> out;
  for (std::int32_t id = 0; id < world.count(); ++id) out.push_back(world.StateOf(id));
  return out;
}

/// A small pyramid of spheres stands on nothing but EPSD and friction.
void HeapAtRest(Rows& rows) {
  BedSpec spec;
  spec.length_m = spec.width_m = 0.3;
  spec.surfaces.rolling_friction = 0.3;
  spec.surfaces.friction = 0.6;
  World world(spec.Config(), Scene(Grid(spec, 0.12, 0.18, 0.12, 0.18, 0, 150), {Floor()}));
  RunOrThrow(world, std::llround(6.0 / world.config().dt_s));
  const std::vector<GrainState> at_6 = States(world);
  RunOrThrow(world, std::llround(2.0 / world.config().dt_s));
  rows.Holds(
      "a heap of 150 grains under EPSD: from 6 s to 8 s no grain moves by 1e-4 of its radius",
      Farthest(world, at_6) < 1e-4, Farthest(world, at_6));
  rows.Holds("and its kinetic energy is under 1e-9 of sum m g d", Restlessness(world) < 1e-9,
             Restlessness(world));
}

void RestFor(Rows& rows, std::int64_t steps) {
  BedSpec spec;
  spec.length_m = spec.width_m = 0.06;
  World world(spec.Config(), Scene(Grid(spec, 0, 0.06, 0, 0.06, 0, 64), {Floor()}));
  RunOrThrow(world, std::llround(3.0 / world.config().dt_s));
  const std::vector<GrainState> before = States(world);
  RunOrThrow(world, steps);
  // Laws that rescale on unloading turn the rounding of overlaps into a creep.
  const double rate = Farthest(world, before) / (static_cast<double>(steps) * world.config().dt_s);
  rows.Holds(
      Format("64 grains at rest for %.0e steps: none creeps by 1e-4 radii per second simulated",
             static_cast<double>(steps)),
      rate < 1e-4, Format("%.2g radii/s", rate));
  rows.Holds("and their kinetic energy stays under 1e-9 of sum m g d", Restlessness(world) < 1e-9,
             Restlessness(world));
}

void KeepFor(Rows& rows, std::int64_t steps) {
  WorldConfig c = Cell(Model({}, {1e7, 0.3}, {.restitution = 1, .friction = 0}), 0.08, 2e-5);
  Random random(3);
  std::vector<GrainState> grains;
  for (int i = 0; i < 64; ++i) {
    GrainState g = {};
    g.x_m = (i % 4 + 0.5) * 0.02, g.y_m = (i / 4 % 4 + 0.5) * 0.02;
    g.z_m = (i / 16 + 0.5) * 0.02 - 0.04;
    g.radius_m = 0.005, g.density_kg_per_m3 = 2500;
    for (double* v : {&g.v_x, &g.v_y, &g.v_z}) *v = random.Between(-0.2, 0.2);
    grains.push_back(g);
  }
  World world(c, Scene(grains, {Floor(-0.05), Plane({0, 0, -1}, {0, 0, 0.05})}));
  const double before = world.KineticEnergy();
  RunOrThrow(world, steps);
  // Whoever is just touching holds some of it: the mean of a few looks.
  double after = 0;
  for (int k = 0; k < 20; ++k) {
    RunOrThrow(world, 500);
    after = std::max(after, world.KineticEnergy());
  }
  rows.Holds(Format("an elastic gas of 64 grains keeps its energy to 1 %% over %.0e steps",
                    static_cast<double>(steps)),
             std::abs(after / before - 1) < 0.01, after / before - 1);
}

void MillionAtRest(Rows& rows) { RestFor(rows, 1000000); }
void MillionOfGas(Rows& rows) { KeepFor(rows, 1000000); }
void HundredMillion(Rows& rows) {
  RestFor(rows, 100000000);
  KeepFor(rows, 100000000);
}

}  // namespace

Cases EnduranceCases() {
  return {{"heap_at_rest", Level::kQuick, HeapAtRest},
          {"million_steps_rest", Level::kDefault, MillionAtRest},
          {"million_steps_gas", Level::kDefault, MillionOfGas},
          {"hundred_million_steps", Level::kFull, HundredMillion}};
}

}  // namespace grouser::dem::verify
