// Rigid clumps and bonds inside a World.
#include <gtest/gtest.h>

#include <cmath>

#include "dem_offline/engine/world/world.h"

namespace grouser::dem {
namespace {

WorldConfig Space(double dt) {
  WorldConfig c;
  c.frame = {0.2, 0.2, 0.4};
  c.gravity_m_per_s2 = {0, 0, 0};
  c.dt_s = dt;
  c.energy = true;
  c.contacts = OneMaterial({1e7, 0.3}, {1.0, 0.0, 0.0});
  return c;
}

/// A template whose numbers are given, not computed: three spheres in a bent
/// row, with three different moments of inertia.
ClumpTemplate Bent() {
  ClumpTemplate t;
  t.members = {{{-0.006, 0.001, 0}, 0.004}, {{0.006, 0.001, 0}, 0.004}, {{0, -0.002, 0}, 0.004}};
  t.volume_m3 = 7e-7;
  t.inertia_per_density = {4e-12, 2e-11, 2.2e-11};
  return t;
}

double Length(const Vec3d& a) { return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

/// Of a clump about its centre [kg m^2/s], world axes, from its spin.
Vec3d SpinMomentum(const ClumpState& s, const Vec3d& inertia_per_density) {
  const auto& q = s.orientation;
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                          {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                          {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
  Vec3d out = {0, 0, 0};
  for (int k = 0; k < 3; ++k) {
    double along = 0;
    for (int i = 0; i < 3; ++i) along += r[i][k] * s.spin_rad_per_s[i];
    for (int i = 0; i < 3; ++i) {
      out[i] += r[i][k] * along * inertia_per_density[k] * s.density_kg_per_m3;
    }
  }
  return out;
}

TEST(Clumps, TumbleFreelyWithConstantEnergyAndMomentum) {
  Contents c;
  c.templates = {Bent()};
  ClumpState s;
  s.density_kg_per_m3 = 2500;
  s.position_m = {0.1, 0.1, 0};
  s.spin_rad_per_s = {3, 40, 2};  // about the middle axis: unstable
  c.clumps = {s};
  World world(Space(1e-4), c);
  const double energy = world.KineticEnergy();
  const Vec3d l0 = SpinMomentum(world.Clump(0), Bent().inertia_per_density);
  double least = 1e9;
  for (int n = 0; n < 20000; ++n) {
    ASSERT_EQ(world.Step(), StepFault::kNone);
    least = std::min(least, world.Clump(0).spin_rad_per_s[1]);
  }
  const Vec3d l1 = SpinMomentum(world.Clump(0), Bent().inertia_per_density);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(l1[k], l0[k], 1e-9 * Length(l0));
  EXPECT_NEAR(world.KineticEnergy(), energy, 1e-4 * energy);
  EXPECT_NEAR(world.Clump(0).position_m[0], 0.1, 1e-12);
}

TEST(Clumps, CollideElasticallyWithoutMakingEnergyOrMomentum) {
  Contents c;
  c.templates = {Bent()};
  ClumpState s;
  s.density_kg_per_m3 = 2500;
  s.position_m = {0.1, 0.1, 0.0};
  c.clumps.push_back(s);
  s.position_m = {0.104, 0.101, 0.0135};
  s.orientation = {0.9, 0.1, 0.3, -0.2};
  s.velocity_m_per_s = {0, 0, -0.3};
  c.clumps.push_back(s);
  World world(Space(2e-6), c);
  const double before = world.Balance().Total();
  for (int n = 0; n < 20000; ++n) ASSERT_EQ(world.Step(), StepFault::kNone);
  const double mass = 2500 * 7e-7;
  double p = 0;
  for (int k = 0; k < 2; ++k) p += mass * world.Clump(k).velocity_m_per_s[2];
  EXPECT_NEAR(p, -0.3 * mass, 1e-6 * 0.3 * mass);
  EXPECT_GT(std::abs(world.Clump(0).velocity_m_per_s[2]), 0.05);  // they did meet
  EXPECT_NEAR(world.Balance().Total(), before, 2e-4 * before);
}

TEST(Clumps, MembersDoNotTouchEachOther) {
  Contents c;
  c.templates = {Bent()};  // its members overlap
  ClumpState s;
  s.density_kg_per_m3 = 2500;
  s.position_m = {0.1, 0.1, 0};
  c.clumps = {s};
  World world(Space(1e-5), c);
  world.Run(10);
  EXPECT_EQ(world.MeanContacts(), 0.0);
  EXPECT_EQ(Length(world.Clump(0).velocity_m_per_s), 0.0);
}

Contents BondedPair(double stretch_speed, BondLaw law) {
  Contents c;
  c.grains = {{0.1, 0.1, 0, 0.005, 2500, -stretch_speed, 0, 0},
              {0.11, 0.1, 0, 0.005, 2500, stretch_speed, 0, 0}};
  c.bond_laws = {law};
  c.bonds = {{0, 1, 0.004, 0}};
  return c;
}

TEST(Bonds, ActBesideTheContactAndLeaveItWhenTheyBreak) {
  BondLaw law;
  law.normal_stiffness_n_per_m3 = 1e7;
  law.shear_stiffness_n_per_m3 = 1e7;
  law.largest_stretch = 1e-3;
  Contents c = BondedPair(-0.01, law);  // towards one another
  World world(Space(1e-6), c);
  const double before = world.Balance().Total();
  const double area = M_PI * 0.004 * 0.004, e_star = 1e7 / (2 * 0.91);
  int checked = 0;
  while (world.bond_statistics().intact == 1 && world.steps() < 100000) {
    ASSERT_EQ(world.Step(), StepFault::kNone);
    const double u = 0.01 - (world.StateOf(1).x_m - world.StateOf(0).x_m);
    if (u < 2e-6 || world.bond_statistics().intact == 0) continue;
    const double hertz = 4.0 / 3 * e_star * std::sqrt(0.0025) * std::pow(u, 1.5);
    ASSERT_NEAR(world.LoadOf(1).fx, 1e7 * area * u + hertz, 0.01 * (1e7 * area * u + hertz));
    ++checked;
  }
  EXPECT_GT(checked, 100);
  const BondStatistics& bonds = world.bond_statistics();
  EXPECT_EQ(bonds.broken_by_stretch, 1);
  EXPECT_EQ(bonds.broken_in_tension + bonds.broken_in_shear, 0);
  EXPECT_NEAR(bonds.broken_j, 0.5 * 1e7 * area * 1e-10, 0.02 * 0.5 * 1e7 * area * 1e-10);
  EXPECT_NEAR(world.Balance().Total(), before, 2e-3 * before);
  world.SetVelocity(0, {0.01, 0, 0}, {0, 0, 0});
  world.SetVelocity(1, {-0.01, 0, 0}, {0, 0, 0});
  bool touched = false;
  for (int n = 0; n < 20000; ++n) {
    ASSERT_EQ(world.Step(), StepFault::kNone);
    touched = touched || world.LoadOf(0).touching > 0;
  }
  EXPECT_TRUE(touched);
}

TEST(Bonds, TheGuardAsksThemToo) {
  BondLaw law;
  law.normal_stiffness_n_per_m3 = law.shear_stiffness_n_per_m3 = 1e10;
  const World soft(Space(1e-7), BondedPair(0, law));
  law.normal_stiffness_n_per_m3 = 1e14;
  const World hard(Space(1e-9), BondedPair(0, law));
  EXPECT_LT(hard.CriticalStep(0.01), 0.1 * soft.CriticalStep(0.01));
}

TEST(Bonds, StretchAtTheFrequencyOfTheirSpring) {
  BondLaw law;
  law.normal_stiffness_n_per_m3 = 1e10;
  law.shear_stiffness_n_per_m3 = 1e10;
  law.beside_contact = false;
  World world(Space(1e-7), BondedPair(0.01, law));
  const double mass = 2500 * 4.0 / 3 * M_PI * std::pow(0.005, 3);
  const double k = 1e10 * M_PI * 0.004 * 0.004;
  const double half_period = M_PI / std::sqrt(2 * k / mass);
  int n = 0;
  do {
    ASSERT_EQ(world.Step(), StepFault::kNone);
    ++n;
  } while (n * 1e-7 < 0.6 * half_period || world.StateOf(1).x_m > 0.11);
  EXPECT_NEAR(n * 1e-7, half_period, 1e-3 * half_period);
  EXPECT_NEAR(world.StateOf(1).v_x, -0.01, 1e-4);
}

TEST(Bonds, KeepEnergyAndAngularMomentumWhileTheyTwistAndBend) {
  BondLaw law;
  law.normal_stiffness_n_per_m3 = 1e10;
  law.shear_stiffness_n_per_m3 = 4e9;
  Contents c = BondedPair(0.002, law);
  c.grains[0].w_x = 4;
  c.grains[0].w_y = -6;
  c.grains[1].v_z = 0.01;
  World world(Space(1e-7), c);
  const double before = world.Balance().Total();
  double largest = 0;
  for (int n = 0; n < 20000; ++n) {
    ASSERT_EQ(world.Step(), StepFault::kNone);
    largest = std::max(largest, world.bond_statistics().stored_j);
  }
  EXPECT_GT(largest, 0.1 * before);  // the bond did work
  EXPECT_NEAR(world.Balance().Total(), before, 2e-3 * before);
}

TEST(Bonds, BreakAtTheirStrengthAndBookTheEnergy) {
  BondLaw law;
  law.normal_stiffness_n_per_m3 = 1e10;
  law.shear_stiffness_n_per_m3 = 1e10;
  law.tensile_strength_pa = 2e4;
  World world(Space(1e-7), BondedPair(0.05, law));
  const double before = world.Balance().Total();
  double stretch = 0;
  while (world.bond_statistics().intact == 1) {
    ASSERT_EQ(world.Step(), StepFault::kNone);
    ASSERT_LT(world.steps(), 100000u);
    stretch = world.StateOf(1).x_m - world.StateOf(0).x_m - 0.01;
  }
  EXPECT_NEAR(1e10 * stretch, 2e4, 0.02 * 2e4);
  EXPECT_EQ(world.bond_statistics().broken_in_tension, 1);
  EXPECT_EQ(world.bond_statistics().broken_in_shear, 0);
  world.Run(1000);
  EXPECT_NEAR(world.Balance().Total(), before, 1e-3 * before);
}

TEST(Bonds, BreakInShearUnderTwist) {
  BondLaw law;
  law.normal_stiffness_n_per_m3 = 1e10;
  law.shear_stiffness_n_per_m3 = 1e10;
  law.shear_strength_pa = 1e4;
  Contents c = BondedPair(0, law);
  c.grains[0].w_x = 20;
  World world(Space(1e-7), c);
  for (int n = 0; n < 20000 && world.bond_statistics().intact; ++n) world.Step();
  EXPECT_EQ(world.bond_statistics().broken_in_shear, 1);
}

TEST(Bonds, BrokenPairsTouchAgain) {
  BondLaw law;
  law.normal_stiffness_n_per_m3 = 1e10;
  law.shear_stiffness_n_per_m3 = 1e10;
  law.shear_strength_pa = 1e4;
  law.beside_contact = false;
  Contents c = BondedPair(-0.001, law);
  c.grains[0].w_x = 20;
  World world(Space(1e-7), c);
  for (int n = 0; n < 20000 && world.bond_statistics().intact; ++n) {
    world.Step();
    if (world.bond_statistics().intact) {
      ASSERT_EQ(world.LoadOf(0).touching, 0.0f);
    }
  }
  for (int n = 0; n < 100000 && world.LoadOf(0).touching == 0.0f; ++n) world.Step();
  EXPECT_EQ(world.LoadOf(0).touching, 1.0f);
}

TEST(Contents, NonsenseIsRefusedByName) {
  Contents c = BondedPair(0, BondLaw{});
  c.bonds[0].grain_b = 7;
  EXPECT_THROW(World(Space(1e-6), c), std::invalid_argument);
  c = BondedPair(0, BondLaw{});
  c.bonds[0].radius_m = 0;
  EXPECT_THROW(World(Space(1e-6), c), std::invalid_argument);
  c = BondedPair(0, BondLaw{.largest_stretch = 0});
  EXPECT_THROW(World(Space(1e-6), c), std::invalid_argument);
  c = Contents{};
  c.clumps.resize(1);
  EXPECT_THROW(World(Space(1e-6), c), std::invalid_argument);
}

}  // namespace
}  // namespace grouser::dem
