// Things that snap, and long runs: what rests must rest, what is kept must be kept.
#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

// Things that snap: necks and bonds.

/// Two grains meet with JKR adhesion and no damping.
struct JkrImpact {
  bool parted = false;
  double restitution = 0, unbooked = 0;
};
JkrImpact Collide(double speed, double gamma) {
  const double r = 1e-4;
  const Elastic e = {1e8, 0.3};
  const double dt =
      ExactHertz(SphereMass(r, 2500) / 2, r / 2, EffectiveModulus(e, e), 0.01).contact_s / 1000;
  WorldConfig c = Cell(Model({.cohesion = "jkr"}, e,
                             {.restitution = 1, .friction = 0, .surface_energy_j_per_m2 = gamma}),
                       0.002, dt);
  c.energy = true;
  World world(c, {{1e-3, 1e-3, 1.02 * r, r, 2500, 0, 0, -speed / 2},
                  {1e-3, 1e-3, -1.02 * r, r, 2500, 0, 0, speed / 2}});
  world.Start();
  const EnergyBalance before = world.Balance();
  // Until they meet, and a few contact times more.
  RunOrThrow(world, std::llround(0.04 * r / speed / dt) + 3000);
  const EnergyBalance after = world.Balance();
  JkrImpact out;
  const double v = world.StateOf(0).v_z - world.StateOf(1).v_z;
  out.parted = world.LoadOf(0).touching == 0 && v > 0;
  out.restitution = v / speed;
  out.unbooked = std::abs(after.Total() - before.Total()) / before.kinetic;
  return out;
}

/// Thornton & Ning, Powder Technol. 99 (1998) 154: the work lost is 7.09
/// (gamma^5 R*^4/E*^2)^(1/3), gamma the work of adhesion halved once for
/// touching; grains slower than its speed stick.
void JkrSnapOff(Rows& rows) {
  const double gamma = 0.02, r = 0.5e-4, m = SphereMass(1e-4, 2500) / 2;
  const double e = EffectiveModulus({1e8, 0.3}, {1e8, 0.3});
  const double lost = 7.09 * std::cbrt(std::pow(gamma, 5) * std::pow(r, 4) / (e * e));
  const double v_s = std::sqrt(2 * lost / m);
  const JkrImpact slow = Collide(0.9 * v_s, gamma), fast = Collide(1.1 * v_s, gamma),
                  quick = Collide(3 * v_s, gamma);
  rows.Holds("JKR: grains 10 % slower than the sticking speed stay together", !slow.parted,
             slow.parted ? "parted" : "stuck");
  rows.Holds("JKR: grains 10 % faster snap off", fast.parted, fast.parted ? "parted" : "stuck");
  const double expected = std::sqrt(1 - 1.0 / 9);
  rows.Holds("JKR: at three sticking speeds the restitution is sqrt(1 - 1/9) to 1 %",
             std::abs(quick.restitution / expected - 1) < 0.01, quick.restitution);
  rows.Below("JKR: making and snapping the neck leaves under 1 % of the energy unbooked", 0.01,
             std::max({slow.unbooked, fast.unbooked, quick.unbooked}));
}

/// A bonded block falls on a hard floor and breaks up.
void BondCascade(Rows& rows) {
  const double r = 0.005, length = 2 * r;
  Contents in;
  const int n = 6;
  for (int i = 0; i < n * n * n; ++i) {
    GrainState g = {};
    g.x_m = 0.1 + i % n * length, g.y_m = 0.1 + i / n % n * length;
    g.z_m = r + 0.001 + i / n / n * length;
    g.radius_m = r, g.density_kg_per_m3 = 2500, g.v_z = -6;
    in.grains.push_back(g);
    const auto bond = [&](int j) { in.bonds.push_back({i, j, 0.8 * r, 0}); };
    if (i % n + 1 < n) bond(i + 1);
    if (i / n % n + 1 < n) bond(i + n);
    if (i / n / n + 1 < n) bond(i + n * n);
  }
  in.bond_laws = {{.normal_stiffness_n_per_m3 = 1e7 / length,
                   .shear_stiffness_n_per_m3 = 4e6 / length,
                   .tensile_strength_pa = 2e5,
                   .shear_strength_pa = 2e5,
                   .damping_ratio = 0.05}};
  in.bodies = {Floor()};
  WorldConfig c = Cell(Model({}, {1e7, 0.3}, {.restitution = 0.5, .friction = 0.5}), 0.4, 5e-6);
  c.gravity_m_per_s2 = {0, 0, -9.81};
  c.energy = true;
  World world(c, in);
  world.Start();
  const EnergyBalance before = world.Balance();
  const auto all = static_cast<std::int64_t>(in.bonds.size());
  bool counted = true;
  std::int64_t last = 0;
  for (int k = 0; k < 200; ++k) {
    RunOrThrow(world, 100);
    const BondStatistics& b = world.bond_statistics();
    std::int64_t intact = 0;
    for (std::int64_t i = 0; i < all; ++i) intact += world.BondIntact(i);
    const std::int64_t broken = b.broken_in_tension + b.broken_in_shear + b.broken_by_stretch;
    counted = counted && intact == b.intact && b.intact + broken == all && broken >= last;
    last = broken;
  }
  const EnergyBalance after = world.Balance();
  rows.Holds("a bonded block of 216 grains strikes the floor at 6 m/s: bonds break, some hold",
             last > 20 && last < all,
             Format("%ld of %ld broken", static_cast<long>(last), static_cast<long>(all)));
  rows.Holds("intact and broken bonds always add up, and no bond heals", counted,
             counted ? "they do" : "they do not");
  rows.Below("the energy not booked stays under 1 % of the impact's", 0.01,
             std::abs(after.Total() - before.Total()) / before.kinetic);
}

// Long runs: what rests must rest, what is kept must be kept.

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
  rows.Below(
      "a heap of 150 grains under EPSD: from 6 s to 8 s no grain moves by 1e-4 of its radius", 1e-4,
      Farthest(world, at_6));
  rows.Below("and its kinetic energy is under 1e-9 of sum m g d", 1e-9, Restlessness(world));
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
  rows.Below("and their kinetic energy stays under 1e-9 of sum m g d", 1e-9, Restlessness(world));
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
  return {{"jkr_snap_off", Level::kQuick, JkrSnapOff},
          {"bond_cascade", Level::kQuick, BondCascade},
          {"heap_at_rest", Level::kQuick, HeapAtRest},
          {"million_steps_rest", Level::kDefault, MillionAtRest},
          {"million_steps_gas", Level::kDefault, MillionOfGas},
          {"hundred_million_steps", Level::kFull, HundredMillion}};
}

}  // namespace grouser::dem::verify
