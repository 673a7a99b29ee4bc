// Things that snap: necks and bonds.
#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/verify/beds.h"
#include "dem_offline/engine/verify/cases.h"

namespace grouser::dem::verify {
namespace {

/// Two grains meet with JKR adhesion and no damping.
struct Impact {
  bool parted = false;
  double restitution = 0, unbooked = 0;
};
Impact Collide(double speed, double gamma) {
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
  Impact out;
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
  const Impact slow = Collide(0.9 * v_s, gamma), fast = Collide(1.1 * v_s, gamma),
               quick = Collide(3 * v_s, gamma);
  rows.Holds("JKR: grains 10 % slower than the sticking speed stay together", !slow.parted,
             slow.parted ? "parted" : "stuck");
  rows.Holds("JKR: grains 10 % faster snap off", fast.parted, fast.parted ? "parted" : "stuck");
  const double expected = std::sqrt(1 - 1.0 / 9);
  rows.Holds("JKR: at three sticking speeds the restitution is sqrt(1 - 1/9) to 1 %",
             std::abs(quick.restitution / expected - 1) < 0.01, quick.restitution);
  const double worst = std::max(std::max(slow.unbooked, fast.unbooked), quick.unbooked);
  rows.Holds("JKR: making and snapping the neck leaves under 1 % of the energy unbooked",
             worst < 0.01, worst);
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
  const double share = std::abs(after.Total() - before.Total()) / before.kinetic;
  rows.Holds("the energy not booked stays under 1 % of the impact's", share < 0.01, share);
}

}  // namespace

Cases SnapCases() {
  return {{"jkr_snap_off", Level::kQuick, JkrSnapOff},
          {"bond_cascade", Level::kQuick, BondCascade}};
}

}  // namespace grouser::dem::verify
