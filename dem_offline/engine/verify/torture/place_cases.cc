// Far away, weightless, alone, or hardly moving.
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/torture/compare.h"

namespace grouser::dem::verify {
namespace {

void FarAway(Rows& rows) {
  const BedSpec spec;
  const std::vector<GrainState> here = Steadied(Settle(spec), spec.Config().frame);
  const double shift = 1e4;
  std::vector<GrainState> there = here;
  for (GrainState& g : there) g.x_m += shift, g.y_m += shift, g.z_m += shift;
  WorldConfig c = spec.Config();
  World near(c, Scene(here, {Floor()}));
  c.origin_m = {shift, shift, shift};
  World far(c, Scene(there, {Plane({0, 0, 1}, c.origin_m)}));
  RunOrThrow(near, 1);
  RunOrThrow(far, 1);
  const double forces = ForceDistance(near, far, Identity());
  rows.Holds("a bed 10 km from the origin: forces after one step equal to 1e-5 of the largest",
             forces < 1e-5, forces);
  RunOrThrow(near, 99);
  RunOrThrow(far, 99);
  const double later = ForceDistance(near, far, Identity());
  rows.Holds("and after 100 steps to 1e-3", later < 1e-3, later);
}

void Gravities(Rows& rows) {
  BedSpec spec;
  spec.length_m = spec.width_m = 0.1;
  const std::vector<GrainState> bed = Settle(spec);
  WorldConfig c = spec.Config();
  c.gravity_m_per_s2 = {0, 0, 0};
  World weightless(c, Scene(bed, {Floor()}));
  RunOrThrow(weightless, std::llround(0.1 / c.dt_s));
  const double kinetic = weightless.KineticEnergy();
  RunOrThrow(weightless, std::llround(0.4 / c.dt_s));
  rows.Holds("a bed without gravity drifts apart and never gains energy",
             kinetic > 0 && weightless.KineticEnergy() <= kinetic * (1 + 1e-6),
             Format("%.3g J, then %.3g J", kinetic, weightless.KineticEnergy()));
  c.gravity_m_per_s2 = {0, 0, -1.62};
  World lunar(c, Scene(bed, {Floor()}));
  RunOrThrow(lunar, std::llround(1.5 / c.dt_s));
  double weight = 0;
  for (std::int64_t i = 0; i < lunar.count(); ++i) weight += 1.62 * lunar.grains()[i].mass;
  const double share = -lunar.wrench(0).fz / weight;
  rows.Holds("a bed under lunar gravity: the floor carries its weight to 1 %",
             std::abs(share - 1) < 0.01, share);
  rows.Holds("and it is at rest: kinetic energy under 1e-6 of sum m g d",
             Restlessness(lunar) < 1e-6, Restlessness(lunar));
}

void OneOrNone(Rows& rows) {
  BedSpec spec;
  const WorldConfig c = spec.Config();
  World none(c, Scene({}, {Floor()}));
  const StepFault fault = none.Run(1000);
  rows.Holds("no grain at all: 1000 steps, no fault, zero energy",
             fault == StepFault::kNone && none.KineticEnergy() == 0 && none.MeanContacts() == 0,
             none.KineticEnergy());
  World one(c, Scene({{0.1, 0.05, 0.03, 0.005, 2290, 0.1, 0, 0}}, {Floor()}));
  RunOrThrow(one, std::llround(2.0 / c.dt_s));
  const GrainState g = one.StateOf(0);
  const double weight = SphereMass(0.005, 2290) * 9.81;
  const double carried = -one.wrench(0).fz / weight;
  rows.Holds("one grain dropped on a floor comes to rest and the floor carries it to 0.1 %",
             std::abs(carried - 1) < 1e-3 && std::hypot(g.v_x, g.v_y, g.v_z) < 1e-5, carried);
}

void SlowCreep(Rows& rows) {
  WorldConfig c = Cell(Model({}, {1e7, 0.3}, {}), 0.3, 1e-4);
  World free(c, {{0.1, 0.1, 0, 0.005, 2500, 1e-6, 0, 0}});
  RunOrThrow(free, 1000000);
  const double way = free.StateOf(0).x_m - 0.1;
  rows.Holds("a grain creeps at 1e-6 m/s for 100 s: 0.1 mm to 0.1 %, it never stalls",
             std::abs(way / 1e-4 - 1) < 1e-3, Format("%.6g m", way));
  World far(c, {{0.1, 0.1, 0.59, 0.005, 2500, 0, 0, 1e-7}});
  RunOrThrow(far, 1000000);
  const double rise = far.StateOf(0).z_m - 0.59;
  rows.Holds("at 1e-7 m/s far up in z: 10 um to 1 %", std::abs(rise / 1e-5 - 1) < 1e-2,
             Format("%.6g m", rise));
}

}  // namespace

Cases PlaceCases() {
  return {{"far_from_origin", Level::kQuick, FarAway},
          {"gravities", Level::kQuick, Gravities},
          {"one_or_none", Level::kQuick, OneOrNone},
          {"slow_creep", Level::kQuick, SlowCreep}};
}

}  // namespace grouser::dem::verify
