// Many worlds at once, on the emulated device: the bodies that a card runs.
#include "tests/unit/engine/ensemble_testing.h"
#include "tests/unit/engine/laws_per_pair.h"

namespace grouser::dem::gpu {
namespace {

TEST(Ensemble, RunsTheStepsOfTheCpuBitByBit) {
  Worlds worlds;
  for (const int seed : {1, 2}) worlds.push_back(Make(seed));
  const auto device = EmulatedDevice();
  Ensemble all = Together(worlds, *device);
  all.Run(1500);
  for (int k = 0; k < 2; ++k) {
    World& cpu = *worlds[k];
    ASSERT_EQ(cpu.Run(1500), StepFault::kNone);
    EXPECT_EQ(all.fault(k), StepFault::kNone);
    EXPECT_EQ(all.steps(k), 1500);
    EXPECT_GT(all.rebuilds(k), 3);
    EXPECT_EQ(all.rebuilds(k), static_cast<std::int32_t>(cpu.rebuilds()));
    ExpectSame(all.Grains(k), Of(cpu));
    const auto loads = all.Loads(k);
    double touching = 0;
    for (std::int64_t i = 0; i < cpu.count(); ++i) {
      ASSERT_EQ(std::memcmp(&loads[i], &cpu.loads()[i], sizeof(GrainLoad)), 0) << "grain " << i;
      touching += loads[i].touching;
    }
    EXPECT_GT(touching, 1.2 * static_cast<double>(cpu.count()));
  }
}

TEST(Ensemble, AWorldDoesNotSeeItsBatchMates) {
  Worlds three;
  three.push_back(Make(4, 1.2e-5));
  three.push_back(Make(5));
  three.push_back(Make(6, 0.8e-5));
  const auto device = EmulatedDevice();
  Ensemble all = Together(three, *device);
  all.Run(700);
  Worlds one;
  one.push_back(Make(5));
  Ensemble alone = Together(one, *device);
  alone.Run(300);
  alone.Run(400);
  ExpectSame(all.Grains(1), alone.Grains(0));
}

TEST(Ensemble, EveryWorldHasItsOwnParameters) {
  Worlds worlds;
  for (const double friction : {0.1, 0.5, 0.9}) {
    WorldConfig c = Config();
    c.contacts = OneMaterial({2e7 * friction, 0.3}, {0.5, friction, 0.1});
    worlds.push_back(std::make_unique<World>(c, Sheared(4)));
  }
  const auto device = EmulatedDevice();
  Ensemble all = Together(worlds, *device);
  all.Run(400);
  for (int k = 0; k < 3; ++k) {
    ASSERT_EQ(worlds[k]->Run(400), StepFault::kNone);
    ExpectSame(all.Grains(k), Of(*worlds[k]));
  }
  EXPECT_NE(all.Grains(0)[200].vx, all.Grains(2)[200].vx);
}

TEST(Ensemble, EveryPairOfMaterialsHasItsOwnLaws) {
  std::vector<GrainState> grains = Sheared(4);
  for (std::size_t k = 0; k < grains.size(); ++k) grains[k].material = static_cast<int>(k % 2);
  Worlds worlds;
  WorldConfig c = Config(2e-6);
  c.contacts = TwoMaterials(ThreeLaws());
  worlds.push_back(std::make_unique<World>(c, grains));
  const auto device = EmulatedDevice();
  Ensemble all = Together(worlds, *device);
  all.Run(1500);
  ASSERT_EQ(worlds[0]->Run(1500), StepFault::kNone);
  EXPECT_GT(all.rebuilds(0), 1);
  ExpectSame(all.Grains(0), Of(*worlds[0]));
  c.contacts = TwoMaterials(ThreeLaws()[0]);
  worlds.push_back(std::make_unique<World>(c, grains));
  EXPECT_THROW(Together(worlds, *device), NotElsewhere);
}

TEST(Ensemble, ShortListsAreRegrownWithoutATrace) {
  Worlds worlds, same;
  worlds.push_back(Make(7));
  same.push_back(Make(7));
  const auto device = EmulatedDevice();
  Ensemble ample = Together(worlds, *device, {24, 60, 40});
  Ensemble tight = Together(same, *device, {1, 2, 7});
  ample.Run(900);
  tight.Run(900);
  EXPECT_EQ(ample.regrowths(), 0);
  EXPECT_GT(tight.regrowths(), 3);
  ExpectSame(tight.Grains(0), ample.Grains(0));
  EXPECT_GT(ample.Plan().Total(), tight.Plan().Total());
}

TEST(Ensemble, AWorldThatFailsStopsAlone) {
  Worlds worlds, same;
  worlds.push_back(Make(8));
  std::vector<GrainState> fast = Sheared(9);
  for (GrainState& g : fast) {
    if (!g.glued) {
      g.v_z = 60;  // more than a quarter radius a step
      break;
    }
  }
  worlds.push_back(std::make_unique<World>(Config(), fast));
  same.push_back(Make(8));
  const auto device = EmulatedDevice();
  Ensemble both = Together(worlds, *device);
  Ensemble good = Together(same, *device);
  both.Run(200);
  good.Run(200);
  EXPECT_EQ(both.fault(0), StepFault::kNone);
  EXPECT_EQ(both.steps(0), 200);
  EXPECT_EQ(both.fault(1), StepFault::kTooFast);
  EXPECT_EQ(both.steps(1), 0);
  ExpectSame(both.Grains(0), good.Grains(0));
}

TEST(Ensemble, RefusesByNameWhatIsNotOnTheDevice) {
  const auto message = [](Worlds worlds) {
    try {
      const auto device = EmulatedDevice();
      Together(worlds, *device);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  Worlds worlds;
  EXPECT_NE(message({}).find("no world"), std::string::npos);
  const auto refused = [&](const WorldConfig& config, const Contents& contents) {
    Worlds two;
    two.push_back(Make(1));
    two.push_back(std::make_unique<World>(config, contents));
    return message(std::move(two));
  };
  Contents contents;
  contents.grains = Sheared(2);
  WorldConfig other = Config();
  other.contacts = OneMaterial({1e7, 0.3}, {0.5, 0.5, 0.1}, ChoiceOf<HertzMindlin>());
  EXPECT_NE(refused(other, contents).find("world 1: laws"), std::string::npos);
  const double up[3] = {0, 0, 1};
  Body floor;
  floor.shape = HalfSpace(up);
  floor.position_m = {0, 0, -0.01};
  contents.bodies.assign(kMostBodies + 1, floor);
  for (Body& b : contents.bodies) b.material = 0;
  EXPECT_NE(refused(Config(), contents).find("world 1: 9 bodies"), std::string::npos);
  contents.bodies.clear();
  contents.bond_laws.push_back({});
  contents.bonds.push_back({.grain_a = 0, .grain_b = 1, .radius_m = 1e-3});
  EXPECT_NE(refused(Config(), contents).find("world 1: bonds"), std::string::npos);
}

}  // namespace
}  // namespace grouser::dem::gpu
