// Bonded grains: what the generator makes, how bonds break, what probes say of them.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "dem_offline/engine/experiment/bonded_grain.h"
#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/engine/world/world.h"
#include "experiment_testing.h"

namespace grouser::dem::experiment {
namespace {

/// A grain of 0.1 m.
Grains Bonded(int fragments, std::int64_t count, double fragment_m) {
  Grains g;
  g.filling = Filling::kPlaced;
  g.material = "sand";
  g.sizes = {{0.1, 1.0}};
  g.places_m = {{0.5, 0.5, 0.0501}};
  g.bonds.fragments = fragments;
  g.bonds.count = count;
  g.bonds.fragment_m = fragment_m;
  g.bonds.law.normal_stiffness_n_per_m3 = g.bonds.law.shear_stiffness_n_per_m3 = 1e8;
  return g;
}

/// A plate comes down on one bonded grain.
Experiment Crushed(double largest_distance) {
  Experiment e = Empty();
  e.grains = {Bonded(60, 140, 0.02)};
  e.grains[0].bonds.largest_distance = largest_distance;
  e.gravity_m_per_s2 = 0;
  BodySpec plate;
  plate.name = "plate";
  plate.material = "steel";
  PartSpec p;
  p.shape = PartShape::kCylinder;
  p.radius_m = 0.15;
  p.length_m = 0.02;
  plate.parts = {p};
  plate.position_m = {0.5, 0.5, 0.1105};
  MotionStep lower;
  lower.verb = "lower";
  lower.velocity_m_per_s = {0, 0, -1};
  lower.distance_m = 0.06;
  plate.motion = {lower};
  e.bodies = {plate};
  e.sample_s = 2e-3;
  const auto probe = [&](Probe::Kind kind, const char* name) {
    Probe out;
    out.kind = kind;
    out.body = "plate";
    out.name = name;
    e.probes.push_back(out);
  };
  probe(Probe::Kind::kBonds, "");
  probe(Probe::Kind::kTouching, "");
  probe(Probe::Kind::kEnergy, "");
  probe(Probe::Kind::kFragments, "fragments");
  probe(Probe::Kind::kBondForces, "forces");
  return e;
}

TEST(BondedGrain, HasTheWantedFragmentsAndTheNearestBonds) {
  for (const auto& [fragments, count, size] :
       {std::tuple{326, 739, 0.01}, {210, 486, 0.1 / 8.3}, {63, 200, 0.02}, {552, 1500, 0.01}}) {
    const Grains g = Bonded(fragments, count, size);
    Random random(7);
    const BondedGrain made = MakeBondedGrain(g, random, "bonds");
    ASSERT_EQ(made.centres_m.size(), fragments);
    ASSERT_EQ(made.bonds.size(), count);
    const std::set<std::array<std::int32_t, 2>> bonds(made.bonds.begin(), made.bonds.end());
    EXPECT_EQ(bonds.size(), made.bonds.size());
    double longest = 0;
    for (int a = 0; a < fragments; ++a) {
      EXPECT_LE(Norm(made.centres_m[a]), 0.05 - 0.5 * size + 1e-12);
      for (int b = a + 1; b < fragments; ++b) {
        const double apart = Norm(Sub(made.centres_m[b], made.centres_m[a]));
        EXPECT_GE(apart, size);
        if (bonds.count({a, b})) {
          longest = std::max(longest, apart);
        } else {
          EXPECT_GE(apart, made.reach_m);
        }
      }
    }
    EXPECT_DOUBLE_EQ(longest, made.reach_m);
    Random again(7);
    EXPECT_EQ(MakeBondedGrain(g, again, "bonds").centres_m, made.centres_m);
  }
}

/// Two glued spheres that part: how long their bond is at most, and how it breaks.
std::pair<double, BondStatistics> Parted(const Bonding& b) {
  constexpr double kSpeed = 0.01, kLength = 0.022;
  WorldConfig c;
  c.frame = {1, 1, 2};
  c.gravity_m_per_s2 = {0, 0, 0};
  c.dt_s = 1e-5;
  c.contacts = OneMaterial({1e7, 0.3}, {1.0, 0.0, 0.0});
  Contents in;
  in.grains = {{0.5, 0.5, 0, 0.01, 2500}, {0.5 + kLength, 0.5, 0, 0.01, 2500, kSpeed}};
  for (GrainState& g : in.grains) g.glued = true;
  in.bond_laws = {BondLawOf(b, kLength)};
  in.bonds = {{0, 1, b.disk_scale * 0.01, 0}};
  World world(c, in);
  double length = kLength;
  while (world.bond_statistics().intact == 1 && world.Step() == StepFault::kNone &&
         length < 2 * kLength) {
    length = world.StateOf(1).x_m - world.StateOf(0).x_m;
  }
  return {length, world.bond_statistics()};
}

TEST(BondedGrain, BondBreaksAtItsStrengthStretchOrDistance) {
  Bonding b;
  b.law.normal_stiffness_n_per_m3 = b.law.shear_stiffness_n_per_m3 = 1e9;
  b.law.tensile_strength_pa = 2e6;  // at 2 mm
  auto [length, broke] = Parted(b);
  EXPECT_NEAR(length, 0.024, 1e-6);
  EXPECT_EQ(broke.broken_in_tension, 1);
  b.largest_distance = 1.05;
  std::tie(length, broke) = Parted(b);
  EXPECT_NEAR(length, 1.05 * 0.022, 1e-6);
  EXPECT_EQ(broke.broken_by_stretch, 1);
  b.law.largest_stretch = 0.02;
  std::tie(length, broke) = Parted(b);
  EXPECT_NEAR(length, 1.02 * 0.022, 1e-6);
  EXPECT_EQ(broke.broken_by_stretch, 1);
}

TEST(BondedGrain, CrushedGrainKeepsEnergyAndCountsItsPieces) {
  Recorded rec;
  const Experiment e = Crushed(1.05);
  const Result result = RunExperiment(e, rec.Sink(), nullptr);
  ASSERT_TRUE(result.done) << result.reason;
  EXPECT_EQ(result.grains, 60);
  const auto intact = rec.Column("bonds.intact"), broken = rec.Column("bonds.share_broken");
  EXPECT_EQ(intact.front(), 140);
  EXPECT_LT(intact.back(), 130);
  EXPECT_DOUBLE_EQ(broken.back(), 1 - intact.back() / 140);
  EXPECT_EQ(rec.Column("bonds.broken_by_stretch").back(), 140 - intact.back());
  EXPECT_GT(result.energy_input_j, 0);
  EXPECT_LT(std::abs(result.energy_residual_j), 0.02 * result.energy_input_j);
  // Tables of the same moment agree with the series.
  const auto state = rec.Column("intact", "forces"), pull = rec.Column("tension_n", "forces"),
             shear = rec.Column("shear_n", "forces");
  ASSERT_EQ(state.size(), 140);
  double left = 0, most = 0;
  for (std::size_t k = 0; k < state.size(); ++k) {
    left += state[k];
    most = std::max(most, std::hypot(pull[k], shear[k]));
  }
  EXPECT_EQ(left, intact.back());
  EXPECT_DOUBLE_EQ(most, rec.Column("bonds.force_max_n").back());
  const auto piece = rec.Column("piece", "fragments"), grain = rec.Column("grain", "fragments"),
             touches = rec.Column("touches_plate", "fragments"), x = rec.Column("x_m", "fragments"),
             y = rec.Column("y_m", "fragments");
  ASSERT_EQ(piece.size(), 60);
  EXPECT_EQ(std::set<double>(piece.begin(), piece.end()).size(), rec.Column("bonds.pieces").back());
  EXPECT_EQ(std::set<double>(grain.begin(), grain.end()), std::set<double>{0});
  double touching = 0, radius = 0;
  for (std::size_t k = 0; k < touches.size(); ++k) {
    touching += touches[k];
    radius += touches[k] * std::hypot(x[k] - 0.5, y[k] - 0.5);
  }
  EXPECT_GT(touching, 3);
  EXPECT_EQ(touching, rec.Column("plate.touching").back());
  EXPECT_NEAR(radius / touching, rec.Column("plate.touching_radius_m").back(), 1e-9);
}

TEST(BondedGrain, WithoutABreakingCriterionNoBondBreaks) {
  Recorded rec;
  Experiment e = Crushed(1e300);
  e.bodies[0].motion[0].distance_m = 0.02;
  ASSERT_TRUE(RunExperiment(e, rec.Sink(), nullptr).done);
  EXPECT_EQ(rec.Column("bonds.intact").back(), 140);
  EXPECT_GT(rec.Column("bonds.force_max_n").back(), 0);
}

std::string Refusal(const Experiment& e) {
  try {
    PlanOf(e);
  } catch (const SpecError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(BondedGrain, RefusesWhatCannotBe) {
  const auto with = [](auto&& change) {
    Experiment e = Crushed(1.05);
    change(&e);
    return Refusal(e);
  };
  const auto starts = [](const std::string& text, const std::string& with) {
    return text.substr(0, with.size()) == with ? "" : text;
  };
  EXPECT_EQ(with([](Experiment*) {}), "accepted");
  EXPECT_EQ(
      starts(with([](Experiment* e) { e->grains[0].bonds.fragments = 100; }),
             "grains[0].bonds.fragments: 100, 0.8 of the grain's volume, expected at most 63"),
      "");
  EXPECT_EQ(starts(with([](Experiment* e) { e->grains[0].bonds.fragment_m = 0.2; }),
                   "grains[0].bonds.fragment_m"),
            "");
  EXPECT_EQ(
      starts(with([](Experiment* e) { e->grains[0].bonds.count = 400; }), "grains[0].bonds.count"),
      "");
  EXPECT_EQ(starts(with([](Experiment* e) { e->grains[0].bonds.largest_distance = 0.9; }),
                   "grains[0].bonds.largest_distance"),
            "");
  EXPECT_EQ(starts(with([](Experiment* e) { e->box.x = Side::kOpen; }),
                   "grains[0].bonds: bonded grains with open sides"),
            "");
  EXPECT_EQ(starts(with([](Experiment* e) {
                     e->grains[0].places_m.push_back({0.55, 0.5, 0.0501});
                   }),
                   "grains[0].places[1].at_m: 0.05 m from place 0"),
            "");
  EXPECT_EQ(starts(with([](Experiment* e) { e->grains[0].places_m[0][2] = 0.01; }),
                   "grains[0].places[0].at_m"),
            "");
  EXPECT_EQ(starts(with([](Experiment* e) { e->grains[0].bonds.fragments = 0; }),
                   "probes[0].kind: bonds without bonded grains"),
            "");
}

/// The step bears stiff bonds of light fragments.
TEST(BondedGrain, StiffBondsShortenTheStep) {
  Experiment e = Crushed(1.05);
  const double loose = PlanOf(e).dt_s;
  e.grains[0].bonds.law.normal_stiffness_n_per_m3 = 1e12;
  const double stiff = PlanOf(e).dt_s;
  EXPECT_LT(stiff, 0.3 * loose);
  e.grains[0].bonds.law.normal_stiffness_n_per_m3 *= 4;
  EXPECT_NEAR(PlanOf(e).dt_s, 0.5 * stiff, 1e-3 * stiff);
}

/// Steel bodies never touch one another: only their contact with grains counts.
TEST(BondedGrain, StiffBodiesShortenTheStepByTheirContactWithGrainsAlone) {
  Experiment e = Crushed(1.05);
  const double rigid = PlanOf(e).dt_s;
  e.materials[1].youngs_modulus_pa = 2e11;
  e.materials.push_back({"rail", 7800, 2e11, 0.3});
  EXPECT_NEAR(PlanOf(e).dt_s, rigid, 1e-3 * rigid);
}

}  // namespace
}  // namespace grouser::dem::experiment
