// Adhesion and bonds.
#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/verify/cases.h"
#include "dem_offline/engine/verify/scenes.h"

namespace grouser::dem::verify {
namespace {

// Adhesion by displacement control: two grains held by hand, drawn apart.

constexpr double kPairRadius = 0.001;
const Elastic kSticky = {1e7, 0.3};

/// Force on the upper grain [N] against the gap [m] while it is drawn away
/// from a start `overlap` by `steps` steps of `stride`.
struct Pull {
  std::vector<double> gap, force;
  double Least() const { return *std::min_element(force.begin(), force.end()); }
  /// Gap of the last place with a force.
  double Last() const {
    double out = -1;
    for (std::size_t k = 0; k < gap.size(); ++k) {
      if (force[k] != 0) out = gap[k];
    }
    return out;
  }
  double At(double g) const {
    for (std::size_t k = 1; k < gap.size(); ++k) {
      if (gap[k] < g) continue;
      const double t = (g - gap[k - 1]) / (gap[k] - gap[k - 1]);
      return force[k - 1] + t * (force[k] - force[k - 1]);
    }
    return 0;
  }
};

Pull DrawApart(const Laws& laws, double gamma, double overlap, double stride, int steps) {
  const double dt = 1e-6;
  ContactModel model =
      Model(laws, kSticky, {.restitution = 1, .friction = 0, .surface_energy_j_per_m2 = gamma});
  GrainState low = {0.01, 0.01, 0, kPairRadius, 2500}, high = low;
  low.glued = high.glued = true;
  high.z_m = 2 * kPairRadius - overlap;
  high.v_z = stride / dt;
  World world(Cell(model, 0.02, dt), {low, high});
  world.Start();
  Pull out;
  for (int s = 0; s < steps; ++s) {
    RunOrThrow(world, 1);
    out.gap.push_back(world.StateOf(1).z_m - world.StateOf(0).z_m - 2 * kPairRadius);
    out.force.push_back(world.LoadOf(1).fz);
  }
  return out;
}

void JkrExact(Rows& rows) {
  const double gamma = 0.5, r = kPairRadius / 2, e = EffectiveModulus(kSticky, kSticky);
  const double off = 1.5 * M_PI * gamma * r;
  const double snap = 0.75 * std::cbrt(M_PI * M_PI * gamma * gamma * r / (e * e));
  const Pull pull = DrawApart({.cohesion = "jkr"}, gamma, 1.5 * snap, snap / 2000, 6000);
  const char* source = "Johnson, Kendall & Roberts 1971";
  rows.Relative("JKR: pull-off force [mN]", -1e3 * off, 1e3 * pull.Least(), 0.001,
                "JKR: 1.5 pi gamma R*");
  rows.Relative("JKR: force at zero overlap over pull-off [-]", -8.0 / 9, pull.At(0) / off, 0.002,
                source);
  rows.Relative("JKR: gap of snap-off [um]", 1e6 * snap, 1e6 * pull.Last(), 0.005, source);
  // The force where the neck snaps under displacement control: 5/9 of pull-off.
  rows.Relative("JKR: force just before snap-off over pull-off [-]", -5.0 / 9,
                pull.At(pull.Last()) / off, 0.05, source);
  double worst = 0;
  for (double a = 0.7; a < 1.6; a += 0.05) {  // contact radius over that at zero load
    const double a0 = std::cbrt(4.5 * M_PI * gamma * r * r / e);
    const double radius = a * a0;
    const double gap = std::sqrt(2 * M_PI * gamma * radius / e) - radius * radius / r;
    const double force = 4 * e * radius * radius * radius / (3 * r) -
                         std::sqrt(8 * M_PI * gamma * e * radius * radius * radius);
    if (gap > 0.98 * snap || gap < pull.gap.front()) continue;
    worst = std::max(worst, std::abs(pull.At(gap) - force) / off);
  }
  rows.AtMost("JKR: force-gap curve, worst distance over pull-off [-]", 0.005, worst, source);
}

/// Before they touch there is no neck: the way in differs from the way out.
void JkrTouch(Rows& rows) {
  const double gamma = 0.5, r = kPairRadius / 2, e = EffectiveModulus(kSticky, kSticky);
  const double off = 1.5 * M_PI * gamma * r;
  const double snap = 0.75 * std::cbrt(M_PI * M_PI * gamma * gamma * r / (e * e));
  const Pull in = DrawApart({.cohesion = "jkr"}, gamma, -1.2 * snap, -snap / 2000, 4000);
  double before = 0, after = 0;
  for (std::size_t k = 0; k < in.gap.size(); ++k) {
    if (in.gap[k] > 0) before = std::max(before, std::abs(in.force[k]));
    if (in.gap[k] <= 0 && after == 0) after = in.force[k];
  }
  rows.AtMost("JKR: largest force before the grains touch [N]", 0, before, "no neck yet");
  rows.Relative("JKR: force on touching over pull-off [-]", -8.0 / 9, after / off, 0.005,
                "Johnson, Kendall & Roberts 1971");
}

void JkrAsPublished(Rows& rows) {
  const double gamma = 0.5, r = kPairRadius / 2;
  const Pull pull = DrawApart({.cohesion = "jkr_added"}, gamma, 2e-8, 1e-10, 190);
  rows.Relative("JKR as added by Shin et al.: force at zero overlap [mN]",
                -1e3 * 6 * M_PI * gamma * r, 1e3 * pull.force.back(), 0.01,
                "6 pi gamma R*, four times JKR");
}

void CapillaryBridge(Rows& rows) {
  const double sigma = 0.072, volume = 1e-12, theta = 0.3;
  const Laws laws = {.cohesion = "capillary",
                     .settings = {{"capillary", "surface_tension_n_per_m", sigma},
                                  {"capillary", "contact_angle_rad", theta},
                                  {"capillary", "bridge_volume_m3", volume}}};
  const double rupture = (1 + theta / 2) * std::cbrt(volume);
  const Pull pull = DrawApart(laws, 0, 1e-8, rupture / 4000, 4400);
  const double at_touch = -2 * M_PI * kPairRadius * sigma * std::cos(theta);
  rows.Relative("capillary bridge: force at zero gap [mN]", 1e3 * at_touch, 1e3 * pull.At(1e-9),
                0.01, "2 pi R sigma cos(theta)");
  rows.Relative("capillary bridge: gap of rupture [um]", 1e6 * rupture, 1e6 * pull.Last(), 0.002,
                "Lian et al. 1993: (1 + theta/2) V^(1/3)");
  double worst = 0;
  for (double share = 0.05; share < 1; share += 0.05) {
    const double s = share * rupture * std::sqrt(kPairRadius / volume);
    const double force = at_touch / (1 + 1.05 * s + 2.5 * s * s);
    worst = std::max(worst, std::abs(pull.At(share * rupture) / force - 1));
  }
  rows.AtMost("capillary bridge: force-gap curve, worst relative distance [-]", 0.005, worst,
              "Willett et al. 2000, closed form");
}

// Bonds: a cantilever under its own weight, stiffnesses and strengths.

constexpr double kBondedDensity = 2500, kBondE = 1e9, kBondG = 0.4e9, kBondLength = 2 * kPairRadius;

const Elastic kBonded = {1e9, 0.3};

BondLaw BondedLaw() {
  return {.normal_stiffness_n_per_m3 = kBondE / kBondLength,
          .shear_stiffness_n_per_m3 = kBondG / kBondLength,
          .beside_contact = false};
}

/// Ten spheres in a row along x, the first one held.
void Cantilever(Rows& rows) {
  const int n = 10;
  const double g = 9.81, dt = 2e-7;
  Contents in;
  for (int i = 0; i < n; ++i) {
    in.grains.push_back({0.01 + kBondLength * i, 0.025, 0, kPairRadius, kBondedDensity});
    if (i > 0) in.bonds.push_back({i - 1, i, kPairRadius, 0});
  }
  in.grains[0].glued = true;
  in.bond_laws = {BondedLaw()};
  WorldConfig c = Cell(Model({}, {1e9, 0.3}, {}), 0.05, dt);
  c.frame.z_span_m = 0.01;  // the tip moves by a micrometre
  c.gravity_m_per_s2 = {0, 0, -g};
  World world(c, in);
  world.SetDrag(1 - 2 * 4200 * dt);  // critical for the first mode, 4200 rad/s
  RunOrThrow(world, std::llround(0.006 / dt));
  const double tip = -world.StateOf(n - 1).z_m;
  const double w = SphereMass(kPairRadius, kBondedDensity) * g,
               inertia = M_PI * std::pow(kPairRadius, 4) / 4;
  const double ei = kBondE * inertia, ga = kBondG * M_PI * kPairRadius * kPairRadius;
  double beam = 0, springs = 0;
  for (int j = 1; j < n; ++j) {
    const double x = j * kBondLength, m = n - j;
    beam += w * x * x * (3 * (n - 1) * kBondLength - x) / (6 * ei);
    // Bond j carries the m grains beyond it: moment at its middle, and shear.
    springs +=
        w * std::pow(kBondLength, 3) * m * m * (m - 0.5) / (2 * ei) + w * m * kBondLength / ga;
  }
  rows.Relative("tip of a bonded cantilever [um]", 0.989, 1e6 * tip, 0.01,
                "Euler beam, loads at the grains: 0.989");
  rows.Relative("the same, against the row of springs [um]", 1e6 * springs, 1e6 * tip, 0.001,
                "bending and shear of nine bonds, exact");
  rows.Note(
      Format("Euler beam by its sum %.4f um, row of springs %.4f um", 1e6 * beam, 1e6 * springs));
}

/// Two held grains, one moving: the load on it after `t`.
struct HeldBond {
  GrainLoad load;
  BondStatistics bonds;
  double largest = 0;  ///< of the force's size
};
HeldBond Strain(const BondLaw& law, Vec3d velocity, Vec3d spin, double t) {
  const double dt = 1e-6;
  Contents in;
  GrainState a = {0.01, 0.025, 0, kPairRadius, kBondedDensity}, b = a;
  a.glued = b.glued = true;
  b.x_m += kBondLength;
  b.v_x = velocity[0], b.v_y = velocity[1], b.v_z = velocity[2];
  b.w_x = spin[0], b.w_y = spin[1], b.w_z = spin[2];
  in.grains = {a, b};
  in.bonds = {{0, 1, kPairRadius, 0}};
  in.bond_laws = {law};
  World world(Cell(Model({}, kBonded, {.restitution = 1}), 0.05, dt), in);
  HeldBond out;
  for (int s = 0; s < std::lround(t / dt); ++s) {
    RunOrThrow(world, 1);
    out.load = world.LoadOf(1);
    out.bonds = world.bond_statistics();
    out.largest = std::max<double>(out.largest, std::hypot(out.load.fx, out.load.fy, out.load.fz));
  }
  return out;
}

void Stiffnesses(Rows& rows) {
  const double t = 1e-3, area = M_PI * kPairRadius * kPairRadius, u = 1e-7, angle = 1e-4;
  const double inertia = area * kPairRadius * kPairRadius / 4;
  const char* source = "Potyondy & Cundall 2004";
  rows.Relative("force of a stretched bond [N]", -kBondE / kBondLength * area * u,
                Strain(BondedLaw(), {u / t, 0, 0}, {0, 0, 0}, t).load.fx, 0.001, source);
  rows.Relative("force of a sheared bond [N]", -kBondG / kBondLength * area * u,
                Strain(BondedLaw(), {0, 0, u / t}, {0, 0, 0}, t).load.fz, 0.001, source);
  rows.Relative("moment of a twisted bond [N m]", -kBondG / kBondLength * 2 * inertia * angle,
                Strain(BondedLaw(), {0, 0, 0}, {angle / t, 0, 0}, t).load.tx, 0.001, source);
  // Turned about the bond's middle, which only bends it.
  const HeldBond bent =
      Strain(BondedLaw(), {0, 0, -0.5 * kBondLength * angle / t}, {0, angle / t, 0}, t);
  rows.Relative("moment of a bent bond [N m]", -kBondE / kBondLength * inertia * angle,
                bent.load.ty, 0.01, source);
}

void Strengths(Rows& rows) {
  const double area = M_PI * kPairRadius * kPairRadius, strength = 1e5, t = 2e-3;
  BondLaw law = BondedLaw();
  law.tensile_strength_pa = strength;
  const HeldBond torn = Strain(law, {1e-3, 0, 0}, {0, 0, 0}, t);
  rows.Relative("largest force of a bond pulled till it breaks [N]", strength * area, torn.largest,
                0.005, "Potyondy & Cundall 2004");
  rows.Absolute("bonds broken in tension [-]", 1, static_cast<double>(torn.bonds.broken_in_tension),
                0, "one was there");
  law = BondedLaw();
  law.shear_strength_pa = strength;
  const HeldBond cut = Strain(law, {0, 0, 1e-3}, {0, 0, 0}, t);
  rows.Relative("largest force of a bond sheared till it breaks [N]", strength * area, cut.largest,
                0.01, "Potyondy & Cundall 2004");
  rows.Absolute("bonds broken in shear [-]", 1, static_cast<double>(cut.bonds.broken_in_shear), 0,
                "one was there");
}

/// An intact bond and the contact of its pair act together, or the bond alone.
void BesideContact(Rows& rows) {
  const double t = 1e-3, u = 1e-6, area = M_PI * kPairRadius * kPairRadius;
  const double bond = kBondE / kBondLength * area * u;
  const double hertz = 4.0 / 3 * EffectiveModulus(kBonded, kBonded) * std::sqrt(0.5 * kPairRadius) *
                       std::pow(u, 1.5);
  BondLaw law = BondedLaw();
  rows.Relative("pressed by 1e-3 radii: force of the bond alone [N]", bond,
                Strain(law, {-u / t, 0, 0}, {0, 0, 0}, t).load.fx, 0.001, "k_n A u");
  law.beside_contact = true;
  rows.Relative("the same beside the contact [N]", bond + hertz,
                Strain(law, {-u / t, 0, 0}, {0, 0, 0}, t).load.fx, 0.002, "k_n A u + Hertz");
  rows.Relative("stretched instead: the contact does nothing [N]", -bond,
                Strain(law, {u / t, 0, 0}, {0, 0, 0}, t).load.fx, 0.001, "k_n A u");
}

void LargestStretch(Rows& rows) {
  const double t = 2e-3, area = M_PI * kPairRadius * kPairRadius, most = 5e-4;
  BondLaw law = BondedLaw();
  law.beside_contact = true;
  law.largest_stretch = most;
  const double at = most * kBondLength, spring = kBondE / kBondLength * area;
  const HeldBond torn = Strain(law, {1e-3, 0, 0}, {0, 0, 0}, t);
  rows.Relative("largest force of a bond pulled to its largest stretch [N]", spring * at,
                torn.largest, 0.005, "k_n A s L");
  rows.Absolute("bonds broken by stretch [-]", 1, static_cast<double>(torn.bonds.broken_by_stretch),
                0, "one was there");
  rows.Relative("energy that it set free [J]", 0.5 * spring * at * at, torn.bonds.broken_j, 0.005,
                "k_n A (s L)^2/2");
  const HeldBond slid = Strain(law, {0, 0, 0.1}, {0, 0, 0}, t);
  rows.Absolute("bonds of grains that slide past one another, broken by stretch [-]", 1,
                static_cast<double>(slid.bonds.broken_by_stretch), 0, "their centres part");
}

}  // namespace

Cases CohesionAndBondCases() {
  return {{"jkr_exact", Level::kQuick, JkrExact},
          {"jkr_touch", Level::kQuick, JkrTouch},
          {"jkr_added", Level::kQuick, JkrAsPublished},
          {"capillary_bridge", Level::kQuick, CapillaryBridge},
          {"bond_cantilever", Level::kQuick, Cantilever},
          {"bond_stiffness", Level::kQuick, Stiffnesses},
          {"bond_strength", Level::kQuick, Strengths},
          {"bond_beside_contact", Level::kQuick, BesideContact},
          {"bond_largest_stretch", Level::kQuick, LargestStretch}};
}

}  // namespace grouser::dem::verify
