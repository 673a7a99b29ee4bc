// Rigid unions of spheres, as grains and as bodies, and worlds of one layer.
#include <algorithm>

#include "dem_offline/engine/bodies/clump.h"
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

double Unbooked(const EnergyBalance& before, const EnergyBalance& after) {
  return std::abs(after.Total() - before.Total()) / before.kinetic;
}

/// In a box that is periodic in x and y.
double Distance(const GrainState& a, const GrainState& b, const Frame& frame) {
  return Norm({std::remainder(a.x_m - b.x_m, frame.length_m),
               std::remainder(a.y_m - b.y_m, frame.width_m), a.z_m - b.z_m});
}

/// Clumps of four spheres, one of them three times as large as the least, strike a floor.
void ClumpHail(Rows& rows) {
  BedSpec spec;
  spec.length_m = spec.width_m = 0.12;
  spec.smallest_d_m = 0.004;  // of the members
  spec.laws = {};
  spec.grains = {2e7, 0.3};
  WorldConfig c = spec.Config();
  c.energy = true;
  c.dt_s *= 0.25;
  Contents in;
  in.bodies = {Floor()};
  in.templates = {MakeClump({{{0, 0, 0}, 0.006},
                             {{0.005, 0, 0}, 0.003},
                             {{-0.004, 0.004, 0}, 0.003},
                             {{0, -0.003, 0.005}, 0.002}})};
  Random random(7);
  const int n = 4;
  for (int i = 0; i < n * n * n; ++i) {
    ClumpState s;
    s.density_kg_per_m3 = 2500;
    s.position_m = {(i % n + 0.5) * 0.03, (i / n % n + 0.5) * 0.03, 0.015 + i / n / n * 0.024};
    Quatd q;
    for (double& x : q) x = random.Between(-1, 1);
    s.orientation = Unit(q);
    s.velocity_m_per_s = {random.Between(-1, 1), random.Between(-1, 1), -5};
    for (double& w : s.spin_rad_per_s) w = random.Between(-200, 200);
    in.clumps.push_back(s);
  }
  World world(c, in);
  world.Start();
  const EnergyBalance before = world.Balance();
  double bent = 0, lowest = 10;
  for (int k = 0; k < 50; ++k) {
    RunOrThrow(world, std::llround(0.001 / c.dt_s));
    for (std::int32_t id = 0; id < world.count(); ++id) {
      const GrainState g = world.StateOf(id);
      lowest = std::min(lowest, g.z_m / g.radius_m);
    }
  }
  const auto& shape = in.templates[0].members;
  for (std::int32_t k = 0; k < n * n * n; ++k) {
    for (std::int32_t j = 1; j < 4; ++j) {
      const double apart = Norm(Sub(shape[j].offset_m, shape[0].offset_m));
      const double is = Distance(world.StateOf(4 * k), world.StateOf(4 * k + j), c.frame);
      bent = std::max(bent, std::abs(is - apart) / apart);
    }
  }
  rows.Below(
      "64 clumps of four spheres, 1 to 3 in size, strike the floor at 5 m/s spinning: members "
      "keep their distances to 1e-5",
      1e-5, bent);
  rows.Below("and the energy not booked stays under 1 % of the impact's", 0.01,
             Unbooked(before, world.Balance()));
  rows.Holds("and no member is past the floor by half its radius", lowest > 0.5, lowest);
}

/// A ring of glued balls is dropped onto a bed, spinning about its axle.
void GluedRing(Rows& rows) {
  BedSpec spec;
  spec.length_m = spec.width_m = 0.12;
  spec.depth_m = 0.03;
  WorldConfig c = spec.Config();
  c.energy = true;
  c.dt_s *= 0.4;  // the error of the booked energy falls in step with it
  Body ring;
  ring.shape = SphereRing(0.01, 0.03, 9);
  ring.motion = BodyMotion::kFree;
  ring.position_m = {0.06, 0.06, 0.1};
  ring.velocity_m_per_s = {0, 0, -2};
  ring.spin_rad_per_s = {0, 60, 0};
  ring.mass_kg = 0.1;
  ring.inertia_kg_m2 = {5e-5, 1e-4, 5e-5};
  World world(c, Scene(Settle(spec), {Floor(), ring}));
  world.Start();
  const EnergyBalance before = world.Balance();
  const double brought = 0.5 * 0.1 * 4 + 0.5 * 1e-4 * 60 * 60;
  double most = 0;
  bool finite = true;
  for (int k = 0; k < 45; ++k) {
    RunOrThrow(world, std::llround(0.01 / c.dt_s));
    const Wrench& f = world.wrench(1);
    finite = finite && std::isfinite(f.fx + f.fy + f.fz + f.tx + f.ty + f.tz);
    most = std::max(most, f.fz);
  }
  const double unbooked = std::abs(world.Balance().Total() - before.Total()) / brought;
  double carried = 0;
  for (int k = 0; k < 40; ++k) {
    RunOrThrow(world, 50);
    carried += world.wrench(1).fz / 40;
  }
  const Body& b = world.body(1);
  rows.Holds(
      "a body of nine glued balls falls on a bed at 2 m/s, spinning: no fault, it is "
      "caught and stays above the floor",
      finite && most > 10 * 0.1 * 9.81 && b.position_m[2] > 0.009, Format("%.3g N at most", most));
  rows.Holds("in the end the bed carries its weight to 2 %",
             std::abs(carried / (0.1 * 9.81) - 1) < 0.02, carried / (0.1 * 9.81));
  rows.Below("and the energy not booked is under 1 % of what it brought", 0.01, unbooked);
}

/// Discs of very different sizes fall in one layer, with every push out of it refused.
void PlanarHail(Rows& rows) {
  WorldConfig c = Cell(Model({.rolling = "epsd"}, {1e7, 0.3},
                             {.restitution = 0.3, .friction = 0.6, .rolling_friction = 0.2}),
                       0.4, 5e-6);
  c.gravity_m_per_s2 = {0, 0, -9.81};
  c.planar = true;
  c.inertia_factor = 0.5;
  c.energy = true;
  Random random(5);
  Contents in;
  in.bodies = {Floor(), Block({0.2, 0.2, 0.04}, {0.1, 0.1, 0.02}, 0.5)};
  for (int i = 0; i < 150; ++i) {
    GrainState g = {};
    g.radius_m = i % 10 == 0 ? 0.012 : random.Between(0.002, 0.004);
    g.x_m = (i % 15 + 0.5) * 0.4 / 15;
    g.y_m = 0.2;
    g.z_m = 0.1 + i / 15 * 0.026;
    g.density_kg_per_m3 = 2500;
    g.mass_kg = 2500 * M_PI * g.radius_m * g.radius_m * 0.01;  // discs
    g.v_x = random.Between(-1, 1);
    g.v_z = -4;
    g.w_y = random.Between(-300, 300);
    in.grains.push_back(g);
  }
  World world(c, in);
  world.Start();
  const EnergyBalance before = world.Balance();
  RunOrThrow(world, 30000);
  bool flat = true, whole = true;
  for (std::int32_t id = 0; id < 150; ++id) {
    const GrainState g = world.StateOf(id), &o = in.grains[id];
    flat = flat && g.y_m == world.StateOf(0).y_m && g.v_y == 0 && g.w_x == 0 && g.w_z == 0;
    whole = whole && g.z_m > 0 && std::isfinite(g.x_m + g.w_y) && o.radius_m > 0;
  }
  rows.Holds(
      "150 discs, 1 to 6 in size, hail on a floor and a tilted block in a planar world: none "
      "leaves the plane by a bit",
      flat && whole, flat ? "in the plane" : "out of it");
  rows.Below("and the energy not booked stays under 1 % of the impact's", 0.01,
             Unbooked(before, world.Balance()));
}

}  // namespace

Cases BodyCases() {
  return {{"clump_hail", Level::kQuick, ClumpHail},
          {"glued_ring", Level::kQuick, GluedRing},
          {"planar_hail", Level::kQuick, PlanarHail}};
}

}  // namespace grouser::dem::verify
