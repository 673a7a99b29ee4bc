// A box that is turned to mix its grains, and the index of their mixing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "dem_offline/engine/experiment/mixing.h"
#include "tests/unit/engine/experiment_testing.h"

namespace grouser::dem::experiment {
namespace {

/// A column of unit cells along x, fine grains where `fine` says so.
double IndexOf(const std::vector<int>& fine, int bins) {
  std::vector<GrainState> grains;
  for (std::size_t k = 0; k < fine.size(); ++k) {
    for (int n = 0; n < (fine[k] ? 8 : 1); ++n) {  // the same volume in every cell
      GrainState s = {};
      s.x_m = static_cast<double>(k) + 0.1 + 0.1 * n;
      s.y_m = s.z_m = 0.5;
      s.radius_m = fine[k] ? 0.05 : 0.1;
      grains.push_back(s);
    }
  }
  Probe p;
  p.region = {{0, 0, 0}, {static_cast<double>(fine.size()), 1, 1}, 0};
  p.n[0] = bins;
  p.diameter_m = 0.15;
  return MeasureMixing(grains, p);
}

TEST(ExperimentMixing, IsZeroApartOneMixedAndBetweenByItsVariance) {
  EXPECT_NEAR(IndexOf({1, 1, 0, 0}, 2), 0, 1e-12);
  EXPECT_NEAR(IndexOf({1, 0, 1, 0}, 2), 1, 1e-12);
  // Shares 3/4 and 1/4 about 1/2: variance 1/16 of 1/4.
  EXPECT_NEAR(IndexOf({1, 1, 1, 0, 1, 0, 0, 0}, 2), 0.75, 1e-12);
  EXPECT_TRUE(std::isnan(IndexOf({1, 1}, 2)));
}

Experiment Layers(int turns) {
  Experiment e = Empty();
  e.materials[0].youngs_modulus_pa = 1e6;
  e.box = {0.144, 0.103, 0.3, Side::kWall, Side::kWall, "steel"};
  e.duration_s = 0.002;
  e.sample_s = 0.001;
  Grains coarse, fine;
  coarse.material = fine.material = "sand";
  coarse.sizes = {{0.02, 1}};
  fine.sizes = {{0.012, 1}};
  // About as much volume of either, one over the other: 7 x 5 x 3 and 11 x 8 x 5. The lattice of
  // the coarse grains fills the box, so that none of the fine ones falls past it.
  coarse.filling = fine.filling = Filling::kLattice;
  coarse.region = {{0, 0, 0}, {0.144, 0.103, 0.062}, 0};
  fine.region = {{0, 0, 0.062}, {0.144, 0.103, 0.124}, 0};
  e.grains = {coarse, fine};
  Preparation settle, turn;
  settle.rest = 1e-3;
  settle.most_s = 0.5;
  turn.kind = Preparation::Kind::kTurn;
  turn.turns = turns;
  turn.rate_rad_per_s = 2.5;
  turn.height_m = 0.14;
  e.preparation = {settle};
  if (turns > 0) e.preparation.insert(e.preparation.end(), {turn, settle});
  Probe mixing, rest;
  mixing.kind = Probe::Kind::kMixing;
  mixing.region = {{0, 0, 0}, {0.144, 0.103, 0.12}, 0};
  mixing.n[0] = mixing.n[2] = 2;
  mixing.diameter_m = 0.015;
  rest.kind = Probe::Kind::kRest;
  e.probes = {mixing, rest};
  return e;
}

TEST(ExperimentTurn, TurningTheBoxMixesItsGrainsAndLeavesThemOnItsFloor) {
  Recorded before, after;
  RunExperiment(Layers(0), before.Sink(), nullptr);
  const Result r = RunExperiment(Layers(2), after.Sink(), nullptr);
  EXPECT_EQ(r.grains, 545u);
  EXPECT_LT(before.Column("mixing").front(), 0.2);
  EXPECT_GT(after.Column("mixing").front(), before.Column("mixing").front() + 0.4);
  EXPECT_LT(after.Column("kinetic_over_weight").front(), 1e-2) << "gravity is down again";
  EXPECT_LT(r.surface_m, 0.14);
  EXPECT_GT(r.surface_m, 0.05);
}

std::string FieldOf(const Experiment& e) {
  try {
    PlanOf(e);
  } catch (const SpecError& error) {
    return error.field();
  }
  return "accepted";
}

TEST(ExperimentTurn, RefusesOpenBoxesAndFastTurns) {
  EXPECT_EQ(FieldOf(Layers(1)), "accepted");
  Experiment e = Layers(1);
  e.box.x = Side::kPeriodic;
  EXPECT_EQ(FieldOf(e), "preparation[1].do");
  e = Layers(1);
  e.preparation[1].rate_rad_per_s = 10;
  EXPECT_EQ(FieldOf(e), "preparation[1].rate_deg_per_s");
  e = Layers(1);
  e.preparation[1].height_m = 0.31;
  EXPECT_EQ(FieldOf(e), "preparation[1].height_m");
}

TEST(ExperimentMixing, RefusesRegionsThatAreNone) {
  Experiment e = Layers(1);
  e.probes[0].region.radius_m = 0.05;
  EXPECT_THROW(PlanOf(e), SpecError);
  e = Layers(1);
  std::swap(e.probes[0].region.low_m[2], e.probes[0].region.high_m[2]);
  EXPECT_THROW(PlanOf(e), SpecError);
}

TEST(ExperimentTurn, ALidThatIsTooLowStopsTheRun) {
  Experiment e = Layers(1);
  e.preparation[1].height_m = 0.05;
  EXPECT_THROW(RunExperiment(e, nullptr, nullptr), std::runtime_error);
}

}  // namespace
}  // namespace grouser::dem::experiment
