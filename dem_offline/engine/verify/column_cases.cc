// Collapse of granular columns: Lube, Huppert, Sparks & Hallworth, J. Fluid
// Mech. 508 (2004) 175: (r_end - r_0)/r_0 = 1.24 a for a < 1.7, 1.6 sqrt(a)
// beyond; Lajeunesse, Mangeney-Castelnau & Vilotte, Phys. Fluids 16 (2004)
// 2371: the same powers.
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

/// Runout over the first radius of a column of this aspect ratio.
double Runout(double aspect) {
  BedSpec spec;
  spec.smallest_d_m = 0.0036, spec.largest_d_m = 0.0044;
  const double r0 = 0.04, side = 0.5 + 0.05 * aspect, middle = side / 2;
  spec.length_m = spec.width_m = side;
  spec.grains = {5e6, 0.3};
  spec.surfaces = {.restitution = 0.5, .friction = 0.5, .rolling_friction = 0.1};
  spec.density = 2500;
  std::vector<GrainState> grains;
  for (const GrainState& g : Grid(spec, middle - r0, middle + r0, middle - r0, middle + r0, 0,
                                  static_cast<int>(18 * 18 * 26 * std::max(aspect, 0.5)))) {
    if (std::hypot(g.x_m - middle, g.y_m - middle) < r0 - 0.003) grains.push_back(g);
  }
  WorldConfig c = spec.Config();
  c.frame.z_span_m = 4;
  Body wall;
  wall.shape = HollowCylinder(r0, 1.6);
  wall.orientation = {std::sqrt(0.5), std::sqrt(0.5), 0, 0};
  wall.position_m = {middle, middle, 0.75};
  World world(c, Scene(grains, {Floor(), wall}));
  RunOrThrow(world, std::llround(0.4 / c.dt_s));
  const double height = Top(world);
  world.body(1).position_m[2] = 1.9;  // lifted off at once, high above
  RunOrThrow(world, std::llround((0.6 + 4 * std::sqrt(2 * height / 9.81)) / c.dt_s));
  std::vector<double> far;
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const GrainState g = world.State(i);
    far.push_back(std::hypot(g.x_m - middle, g.y_m - middle) + g.radius_m);
  }
  std::sort(far.begin(), far.end());
  // Single grains roll on alone: the edge is where 98 % have stopped.
  return far[static_cast<std::size_t>(0.98 * far.size())] / r0 - 1;
}

void Collapse(Rows& rows) {
  const double aspects[] = {0.6, 1.2, 3, 6, 12};
  std::vector<double> out;
  std::string all;
  for (const double a : aspects) {
    out.push_back(Runout(a));
    all += Format("%s%.2f at %g", all.empty() ? "" : ", ", out.back(), a);
  }
  rows.Absolute("power of the runout in the aspect ratio, 0.6 to 1.2 [-]", 1,
                std::log(out[1] / out[0]) / std::log(2.0), 0.2, "Lube et al. 2004");
  rows.Absolute("power of the runout in the aspect ratio, 3 to 12 [-]", 0.5,
                std::log(out[4] / out[2]) / std::log(4.0), 0.1, "Lube et al. 2004");
  rows.Note("runout over the first radius: " + all);
}

}  // namespace

Cases ColumnCases() { return {{"column_collapse", Level::kFull, Collapse}}; }

}  // namespace grouser::dem::verify
