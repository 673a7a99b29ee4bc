// Pairs of materials with laws of their own, in one world: each as where its laws are the only
// ones.
#include "tests/unit/engine/laws_per_pair.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dem_offline/engine/experiment/plan.h"
#include "dem_offline/engine/world/world.h"
#include "tests/unit/engine/experiment_testing.h"

namespace grouser::dem {
namespace {

using experiment::Experiment;

TEST(LawsPerPair, OneChoiceEverywhereIsCompiledAsBefore) {
  const LawChoice atv = ChoiceOf<AtvWheel>();
  const ContactModel same = TwoMaterials(atv);  // the model's own laws are others
  EXPECT_STREQ(CombinationName(same.combination()), "atv_wheel");
  EXPECT_EQ(same.layout().words, AtvWheel::kWords);
  EXPECT_EQ(TwoMaterials(ThreeLaws()).combination(), -1);
}

TEST(LawsPerPair, HistoriesShareWordsThatTurnAlike) {
  const WordLayout all = TwoMaterials(ThreeLaws()).layout();
  unsigned turning = 0;
  for (const LawChoice& laws : ThreeLaws()) {
    const WordLayout one = LayoutOf(laws);
    EXPECT_LE(one.words, all.words);
    turning |= one.vector_words >> one.t << all.t & ((1u << all.r) - 1);
  }
  EXPECT_LE(all.words, kMaxHistoryWords);
  EXPECT_EQ(all.vector_words, turning | 0b111u << all.r);  // T, its axis; epsd's moment
  EXPECT_EQ(turning, 0b111111u << all.t);
}

TEST(LawsPerPair, StepAndRangeAreThoseOfTheHardestPair) {
  const ContactModel mixed = TwoMaterials(ThreeLaws());
  const ContactSize size = PairOf(1e-5, 2e-3, 1e-4);
  ContactBounds most;
  for (int pair = 0; pair < 3; ++pair) {
    const int a = pair / 2, b = (pair + 1) / 2;
    const ContactBounds one = TwoMaterials(ThreeLaws()[pair]).Bounds(a, b, size);
    const ContactBounds here = mixed.Bounds(a, b, size);
    EXPECT_EQ(here.normal.stiffness, one.normal.stiffness) << pair;
    EXPECT_EQ(here.tangential.stiffness, one.tangential.stiffness) << pair;
    EXPECT_EQ(here.rolling.damping, one.rolling.damping) << pair;
    most.normal.stiffness = std::max(most.normal.stiffness, one.normal.stiffness);
  }
  EXPECT_EQ(mixed.Bounds(size).normal.stiffness, most.normal.stiffness);
  EXPECT_EQ(mixed.StepShare(), RollingOwnSpin::kStepShare);
  const ContactModel cohesive = TwoMaterials(ThreeLaws()[2]);
  EXPECT_GT(mixed.Range(1e-3, 2e-3), 0);
  EXPECT_LE(mixed.Range(1e-3, 2e-3), cohesive.Range(1e-3, 2e-3));
}

TEST(LawsPerPair, AnotherWorldsLawsAreRefused) {
  WorldConfig c;
  c.frame = {0.1, 0.1, 1.0};
  c.contacts = TwoMaterials(ThreeLaws());
  World world(c, std::vector<GrainState>{});
  EXPECT_NO_THROW(world.SetContacts(TwoMaterials(ThreeLaws())));
  EXPECT_THROW(world.SetContacts(TwoMaterials(ThreeLaws()[0])), std::invalid_argument);
}

/// Two spinning grains of materials a and b that graze each other.
World Collision(const ContactModel& contacts, int a, int b) {
  WorldConfig c;
  c.frame = {0.1, 0.1, 1.0};
  c.gravity_m_per_s2 = {0, 0, 0};
  c.dt_s = 1e-6;
  c.contacts = contacts;
  c.energy = true;
  GrainState left = {0.047, 0.050, 0, 0.003, 2500}, right = {0.0535, 0.051, 0.0005, 0.0034, 2600};
  left.v_x = 0.3, left.v_z = 0.1, left.w_y = 40, left.material = a;
  right.v_x = -0.2, right.w_x = 25, right.w_y = -10, right.material = b;
  return World(c, {left, right});
}

TEST(LawsPerPair, UnlikeGrainsCollideAsWhereTheirLawsAreTheOnlyOnes) {
  for (int pair = 0; pair < 3; ++pair) {
    const int a = pair / 2, b = (pair + 1) / 2;
    World mixed = Collision(TwoMaterials(ThreeLaws()), a, b),
          alone = Collision(TwoMaterials(ThreeLaws()[pair]), a, b);
    ASSERT_EQ(mixed.Run(3000), StepFault::kNone);
    ASSERT_EQ(alone.Run(3000), StepFault::kNone);
    for (const std::int32_t id : {0, 1}) {
      const GrainState p = mixed.StateOf(id), q = alone.StateOf(id);
      EXPECT_EQ(p.x_m, q.x_m) << pair;
      EXPECT_EQ(p.v_x, q.v_x) << pair;
      EXPECT_EQ(p.v_z, q.v_z) << pair;
      EXPECT_EQ(p.w_x, q.w_x) << pair;
      EXPECT_EQ(p.w_y, q.w_y) << pair;
    }
    EXPECT_LT(mixed.StateOf(0).v_x, 0.29);  // they have met
    EXPECT_NE(mixed.energy().rolling, 0) << pair;
    EXPECT_EQ(mixed.energy().rolling, alone.energy().rolling) << pair;
    EXPECT_EQ(mixed.energy().slip, alone.energy().slip) << pair;
    EXPECT_EQ(mixed.energy().plastic, alone.energy().plastic) << pair;
  }
}

/// A grain falls on a plate of steel and one on a plate of rubber; first, second: normal laws of
/// these, each with a tangential law that may stand beside it.
Experiment Drops(const std::string& first, const std::string& second) {
  Experiment e = experiment::Empty();
  e.gravity_m_per_s2 = 0;
  e.materials = {{"sand", 2500, 5e6, 0.3}, {"steel", 7800, 0, 0}, {"rubber", 1100, 0, 0}};
  e.interfaces = {{"sand", "any", 0.7, 0.5, 0, {}},
                  {"sand", "steel", 0.7, 0.5, 0, {}},
                  {"sand", "rubber", 0.7, 0.5, 0, {}}};
  for (int k = 0; k < 2; ++k) {
    const std::string& normal = k == 0 ? first : second;
    auto& f = e.interfaces[static_cast<std::size_t>(k) + 1];
    f.normal = normal;
    if (normal == "linear_spring") {
      f.tangential = "linear_history";
      f.numbers.settings = {{"linear_spring", "stiffness_n_per_m", 2e4}};
    }
    experiment::BodySpec plate;
    plate.name = k == 0 ? "steel" : "rubber";
    plate.material = plate.name;
    experiment::PartSpec p;
    p.shape = experiment::PartShape::kBox;
    p.size_m = {0.1, 0.1, 0.02};
    plate.parts = {p};
    plate.position_m = {k == 0 ? 0.3 : 0.6, 0.5, 0.2};
    e.bodies.push_back(plate);
    GrainState s = {plate.position_m[0], 0.5, 0.221, 0.01, 2500};
    s.v_z = -0.5;
    s.v_y = 0.2;
    e.grains[0].listed.push_back(s);
    experiment::Probe probe;
    probe.kind = experiment::Probe::Kind::kWrench;
    probe.body = plate.name;
    e.probes.push_back(probe);
  }
  experiment::Probe all;
  all.kind = experiment::Probe::Kind::kGrains;
  all.name = "grains";
  e.probes.push_back(all);
  e.rayleigh_fraction = 0.02;  // one step for all laws
  e.duration_s = 0.02;
  e.sample_s = 2e-4;
  return e;
}

TEST(LawsPerPair, OneFileHoldsASpringAndHertz) {
  const auto run = [](const Experiment& e) {
    experiment::Recorded rec;
    const experiment::Result result = RunExperiment(e, rec.Sink(), nullptr);
    EXPECT_TRUE(result.done) << result.reason;
    return rec;
  };
  const std::string spring = "linear_spring", hertz = "hertz_restitution";
  const auto mixed = run(Drops(spring, hertz)), springs = run(Drops(spring, spring)),
             hertzes = run(Drops(hertz, hertz));
  const auto force = [](const experiment::Recorded& r, const char* of) {
    return r.Column(std::string(of) + ".f_z_n");
  };
  EXPECT_EQ(force(mixed, "steel"), force(springs, "steel"));
  EXPECT_EQ(force(mixed, "rubber"), force(hertzes, "rubber"));
  EXPECT_NE(force(mixed, "steel"), force(mixed, "rubber"));
  // Both laws leave the restitution that they are given.
  const auto x = mixed.Column("x_m", "grains"), v_z = mixed.Column("v_z_m_per_s", "grains");
  ASSERT_EQ(x.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    if (x[k] >= 0.8) continue;
    EXPECT_NEAR(v_z[k] / 0.5, 0.7, x[k] < 0.5 ? 1e-3 : 5e-3) << x[k];
  }
}

TEST(LawsPerPair, ARunGoesOnFromACheckpointInBothContacts) {
  Experiment e = Drops("linear_spring", "hertz_restitution");
  e.checkpoint_every_s = 0.003;  // both touch from 0.002 s on, for 0.002 s or more
  experiment::RunExtras extras;
  std::string saved;
  extras.checkpoint = [&](const std::string& bytes) {
    if (saved.empty()) saved = bytes;
  };
  experiment::Recorded whole, rest;
  ASSERT_TRUE(RunExperiment(e, whole.Sink(), nullptr, {}, extras).done);
  extras.checkpoint = nullptr;
  extras.resume = saved;
  ASSERT_TRUE(RunExperiment(e, rest.Sink(), nullptr, {}, extras).done);
  EXPECT_NE(rest.Column("steel.f_z_n").front(), 0);
  EXPECT_NE(rest.Column("rubber.f_y_n").front(), 0);
  EXPECT_LT(rest.Column("time_s").size(), whole.Column("time_s").size());
  for (const char* column : {"v_y_m_per_s", "v_z_m_per_s", "w_x_rad_per_s"}) {
    EXPECT_EQ(rest.Column(column, "grains"), whole.Column(column, "grains")) << column;
  }
}

TEST(LawsPerPair, LawsThatDoNotFitAreRefusedByMaterials) {
  Experiment e = Drops("linear_spring", "hertz_restitution");
  e.interfaces[1].tangential = {};  // mindlin, as in the experiment's laws
  try {
    PlanOf(e);
    FAIL();
  } catch (const SpecError& error) {
    EXPECT_EQ(error.field(), "interfaces[1]");
    EXPECT_EQ(
        error.got(),
        "sand and steel: laws: tangential law 'mindlin' needs a Hertzian contact radius, which "
        "normal law 'linear_spring' does not have");
  }
}

TEST(LawsPerPair, ABedOfAWheelTestHasOneChoice) {
  Experiment e = Drops("linear_spring", "hertz_restitution");
  e.gravity_m_per_s2 = 9.81;
  e.grains[0].filling = experiment::Filling::kBed;
  e.grains[0].sizes = {{0.01, 1}};
  try {
    PlanOf(e);
    FAIL();
  } catch (const SpecError& error) {
    EXPECT_EQ(error.field(), "grains[0].kind");
    EXPECT_EQ(error.got(), "bed with interfaces that have laws of their own");
  }
}

TEST(LawsPerPair, ABedIsPreparedWithWhatHoldsBetweenItsGrains) {
  Experiment e = Drops("hertz_restitution", "hertz_restitution");
  e.grains[0].filling = experiment::Filling::kBed;
  e.grains[0].sizes = {{0.01, 1}};
  const auto pair = [](const char* a, const char* b, double friction) {
    experiment::PairProperties p;
    p.a = a;
    p.b = b;
    p.friction = friction;
    p.numbers.rolling_damping = friction;
    return p;
  };
  const std::string sand = e.grains[0].material, steel = e.box.material;
  const auto soil = [&] { return BedOf(e, e.grains[0]).soil; };
  e.interfaces = {pair("any", "any", 0.7)};
  EXPECT_EQ(soil().friction, 0.7);
  EXPECT_FALSE(soil().contact.floor.rolling_damping);  // as among the grains
  e.interfaces = {pair(sand.c_str(), "any", 0.6), pair("any", "any", 0.7)};
  EXPECT_EQ(soil().friction, 0.6);
  e.interfaces = {pair(sand.c_str(), sand.c_str(), 0.5), pair(sand.c_str(), "any", 0.6),
                  pair(steel.c_str(), sand.c_str(), 0.4)};
  EXPECT_EQ(soil().friction, 0.5);
  EXPECT_EQ(soil().contact.floor.rolling_damping, 0.4);
}

}  // namespace
}  // namespace grouser::dem
