// Bonds: a cantilever under its own weight, stiffnesses and strengths.
#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {
namespace {

constexpr double kRadius = 0.001, kDensity = 2500, kE = 1e9, kG = 0.4e9, kLength = 2 * kRadius;

const Elastic kSand = {1e9, 0.3};

BondLaw Law() {
  return {.normal_stiffness_n_per_m3 = kE / kLength,
          .shear_stiffness_n_per_m3 = kG / kLength,
          .beside_contact = false};
}

/// Ten spheres in a row along x, the first one held.
void Cantilever(Rows& rows) {
  const int n = 10;
  const double g = 9.81, dt = 2e-7;
  Contents in;
  for (int i = 0; i < n; ++i) {
    in.grains.push_back({0.01 + kLength * i, 0.025, 0, kRadius, kDensity});
    if (i > 0) in.bonds.push_back({i - 1, i, kRadius, 0});
  }
  in.grains[0].glued = true;
  in.bond_laws = {Law()};
  WorldConfig c = Cell(Model({}, {1e9, 0.3}, {}), 0.05, dt);
  c.frame.z_span_m = 0.01;  // the tip moves by a micrometre
  c.gravity_m_per_s2 = {0, 0, -g};
  World world(c, in);
  world.SetDrag(1 - 2 * 4200 * dt);  // critical for the first mode, 4200 rad/s
  RunOrThrow(world, std::llround(0.006 / dt));
  const double tip = -world.StateOf(n - 1).z_m;
  const double w = SphereMass(kRadius, kDensity) * g, inertia = M_PI * std::pow(kRadius, 4) / 4;
  const double ei = kE * inertia, ga = kG * M_PI * kRadius * kRadius;
  double beam = 0, springs = 0;
  for (int j = 1; j < n; ++j) {
    const double x = j * kLength, m = n - j;
    beam += w * x * x * (3 * (n - 1) * kLength - x) / (6 * ei);
    // Bond j carries the m grains beyond it: moment at its middle, and shear.
    springs += w * std::pow(kLength, 3) * m * m * (m - 0.5) / (2 * ei) + w * m * kLength / ga;
  }
  rows.Relative("tip of a bonded cantilever [um]", 0.989, 1e6 * tip, 0.01,
                "Euler beam, loads at the grains: 0.989");
  rows.Relative("the same, against the row of springs [um]", 1e6 * springs, 1e6 * tip, 0.001,
                "bending and shear of nine bonds, exact");
  rows.Note(
      Format("Euler beam by its sum %.4f um, row of springs %.4f um", 1e6 * beam, 1e6 * springs));
}

/// Two held grains, one moving: the load on it after `t`.
struct Held {
  GrainLoad load;
  BondStatistics bonds;
  double largest = 0;  ///< of the force's size
};
Held Strain(const BondLaw& law, Vec3d velocity, Vec3d spin, double t) {
  const double dt = 1e-6;
  Contents in;
  GrainState a = {0.01, 0.025, 0, kRadius, kDensity}, b = a;
  a.glued = b.glued = true;
  b.x_m += kLength;
  b.v_x = velocity[0], b.v_y = velocity[1], b.v_z = velocity[2];
  b.w_x = spin[0], b.w_y = spin[1], b.w_z = spin[2];
  in.grains = {a, b};
  in.bonds = {{0, 1, kRadius, 0}};
  in.bond_laws = {law};
  World world(Cell(Model({}, kSand, {.restitution = 1}), 0.05, dt), in);
  Held out;
  for (int s = 0; s < std::lround(t / dt); ++s) {
    RunOrThrow(world, 1);
    out.load = world.LoadOf(1);
    out.bonds = world.bond_statistics();
    out.largest = std::max<double>(out.largest, std::hypot(out.load.fx, out.load.fy, out.load.fz));
  }
  return out;
}

void Stiffnesses(Rows& rows) {
  const double t = 1e-3, area = M_PI * kRadius * kRadius, u = 1e-7, angle = 1e-4;
  const double inertia = area * kRadius * kRadius / 4;
  const char* source = "Potyondy & Cundall 2004";
  rows.Relative("force of a stretched bond [N]", -kE / kLength * area * u,
                Strain(Law(), {u / t, 0, 0}, {0, 0, 0}, t).load.fx, 0.001, source);
  rows.Relative("force of a sheared bond [N]", -kG / kLength * area * u,
                Strain(Law(), {0, 0, u / t}, {0, 0, 0}, t).load.fz, 0.001, source);
  rows.Relative("moment of a twisted bond [N m]", -kG / kLength * 2 * inertia * angle,
                Strain(Law(), {0, 0, 0}, {angle / t, 0, 0}, t).load.tx, 0.001, source);
  // Turned about the bond's middle, which only bends it.
  const Held bent = Strain(Law(), {0, 0, -0.5 * kLength * angle / t}, {0, angle / t, 0}, t);
  rows.Relative("moment of a bent bond [N m]", -kE / kLength * inertia * angle, bent.load.ty, 0.01,
                source);
}

void Strengths(Rows& rows) {
  const double area = M_PI * kRadius * kRadius, strength = 1e5, t = 2e-3;
  BondLaw law = Law();
  law.tensile_strength_pa = strength;
  const Held torn = Strain(law, {1e-3, 0, 0}, {0, 0, 0}, t);
  rows.Relative("largest force of a bond pulled till it breaks [N]", strength * area, torn.largest,
                0.005, "Potyondy & Cundall 2004");
  rows.Absolute("bonds broken in tension [-]", 1, static_cast<double>(torn.bonds.broken_in_tension),
                0, "one was there");
  law = Law();
  law.shear_strength_pa = strength;
  const Held cut = Strain(law, {0, 0, 1e-3}, {0, 0, 0}, t);
  rows.Relative("largest force of a bond sheared till it breaks [N]", strength * area, cut.largest,
                0.01, "Potyondy & Cundall 2004");
  rows.Absolute("bonds broken in shear [-]", 1, static_cast<double>(cut.bonds.broken_in_shear), 0,
                "one was there");
}

/// An intact bond and the contact of its pair act together, or the bond alone.
void BesideContact(Rows& rows) {
  const double t = 1e-3, u = 1e-6, area = M_PI * kRadius * kRadius;
  const double bond = kE / kLength * area * u;
  const double hertz =
      4.0 / 3 * EffectiveModulus(kSand, kSand) * std::sqrt(0.5 * kRadius) * std::pow(u, 1.5);
  BondLaw law = Law();
  rows.Relative("pressed by 1e-3 radii: force of the bond alone [N]", bond,
                Strain(law, {-u / t, 0, 0}, {0, 0, 0}, t).load.fx, 0.001, "k_n A u");
  law.beside_contact = true;
  rows.Relative("the same beside the contact [N]", bond + hertz,
                Strain(law, {-u / t, 0, 0}, {0, 0, 0}, t).load.fx, 0.002, "k_n A u + Hertz");
  rows.Relative("stretched instead: the contact does nothing [N]", -bond,
                Strain(law, {u / t, 0, 0}, {0, 0, 0}, t).load.fx, 0.001, "k_n A u");
}

void LargestStretch(Rows& rows) {
  const double t = 2e-3, area = M_PI * kRadius * kRadius, most = 5e-4;
  BondLaw law = Law();
  law.beside_contact = true;
  law.largest_stretch = most;
  const double at = most * kLength, spring = kE / kLength * area;
  const Held torn = Strain(law, {1e-3, 0, 0}, {0, 0, 0}, t);
  rows.Relative("largest force of a bond pulled to its largest stretch [N]", spring * at,
                torn.largest, 0.005, "k_n A s L");
  rows.Absolute("bonds broken by stretch [-]", 1, static_cast<double>(torn.bonds.broken_by_stretch),
                0, "one was there");
  rows.Relative("energy that it set free [J]", 0.5 * spring * at * at, torn.bonds.broken_j, 0.005,
                "k_n A (s L)^2/2");
  const Held slid = Strain(law, {0, 0, 0.1}, {0, 0, 0}, t);
  rows.Absolute("bonds of grains that slide past one another, broken by stretch [-]", 1,
                static_cast<double>(slid.bonds.broken_by_stretch), 0, "their centres part");
}

}  // namespace

Cases BondCases() {
  return {{"bond_cantilever", Level::kQuick, Cantilever},
          {"bond_stiffness", Level::kQuick, Stiffnesses},
          {"bond_strength", Level::kQuick, Strengths},
          {"bond_beside_contact", Level::kQuick, BesideContact},
          {"bond_largest_stretch", Level::kQuick, LargestStretch}};
}

}  // namespace grouser::dem::verify
