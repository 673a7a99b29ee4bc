// Bodies in worlds of an ensemble, and worlds that come back to be changed.
#include <cmath>

#include "dem_offline/engine/bodies/mesh.h"
#include "tests/unit/engine/ensemble_testing.h"

namespace grouser::dem::gpu {
namespace {

/// Grains on a floor, two materials, under gravity.
WorldConfig OnFloor() {
  WorldConfig c = Config(8e-6);
  c.gravity_m_per_s2 = {0, 0, -9.81};
  ContactModel model;
  model.AddMaterial({1e7, 0.3});
  model.AddMaterial({kRigid, 0.0});
  model.SetContactProperties(0, 0, {0.5, 0.5, 0.1});
  model.SetContactProperties(0, 1, {0.4, 0.3, 0.1});
  c.contacts = model;
  return c;
}

std::vector<GrainState> Bed(int seed) {
  std::vector<GrainState> grains = Sheared(seed);
  for (GrainState& g : grains) {
    g.glued = false;
    g.z_m += 0.0012;
    g.v_x *= 0.1;
  }
  return grains;
}

Body Floor() {
  const double up[3] = {0, 0, 1};
  Body b;
  b.shape = HalfSpace(up);
  return b;
}

/// A wheel that rolls and presses on the bed.
Body Wheel(bool treaded) {
  Body b;
  Tread t;
  t.count = 7;
  t.height_m = 0.0015;
  t.root_thickness_m = 0.0012;
  b.shape = treaded ? TreadedWheel(0.006, 0.011, {t}) : SmoothWheel(0.006, 0.011);
  b.motion = BodyMotion::kPrescribed;
  b.position_m = {0.012, 0.012, 0.0222 + (treaded ? 0.0015 : 0)};
  b.velocity_m_per_s = {0.3, 0.05, -0.15};
  b.spin_rad_per_s = {0, 70, 0};
  return b;
}

Body Plate() {
  Body b;
  b.shape = Box(0.008, 0.008, 0.002);
  b.motion = BodyMotion::kFree;
  b.mass_kg = 4e-4;
  b.inertia_kg_m2 = {4e-9, 4e-9, 6e-9};
  b.position_m = {0.024, 0.006, 0.0185};
  b.orientation = {std::cos(0.1), std::sin(0.1), 0, 0};
  b.velocity_m_per_s = {0, 0, -0.3};
  return b;
}

std::unique_ptr<World> WithBodies(int seed, const std::vector<Body>& bodies, bool energy = false) {
  Contents contents;
  contents.grains = Bed(seed);
  contents.bodies = bodies;
  WorldConfig config = OnFloor();
  config.energy = energy;
  return std::make_unique<World>(config, contents);
}

void ExpectSameBodies(const Ensemble& all, int world, const World& cpu) {
  for (int b = 0; b < cpu.bodies(); ++b) {
    const BodyTrack track = all.TrackOf(world, b);
    EXPECT_EQ(std::memcmp(&track.wrench, &cpu.wrench(b), sizeof(Wrench)), 0) << "body " << b;
    EXPECT_EQ(all.BodyOf(world, b).position_m, cpu.body(b).position_m) << "body " << b;
    EXPECT_EQ(all.BodyOf(world, b).orientation, cpu.body(b).orientation) << "body " << b;
    EXPECT_EQ(track.work_j, cpu.state().bodies[b].work_j) << "body " << b;
  }
}

TEST(EnsembleBodies, AreThoseOfTheCpuBitByBit) {
  Worlds worlds;
  worlds.push_back(WithBodies(1, {Floor(), Wheel(false)}));
  worlds.push_back(WithBodies(2, {Floor(), Wheel(true), Plate()}));
  worlds.push_back(WithBodies(3, {Floor()}));
  const auto device = EmulatedDevice();
  Ensemble all = Together(worlds, *device);
  all.Run(1200);
  for (int k = 0; k < 3; ++k) {
    ASSERT_EQ(worlds[k]->Run(1200), StepFault::kNone);
    EXPECT_EQ(all.fault(k), StepFault::kNone);
    ExpectSame(all.Grains(k), Of(*worlds[k]));
    ExpectSameBodies(all, k, *worlds[k]);
  }
  EXPECT_GT(all.TrackOf(0, 1).wrench.fz, 0.005);
  EXPECT_GT(all.TrackOf(1, 1).wrench.fz, 0.005);
  EXPECT_GT(std::abs(all.BodyOf(1, 2).spin_rad_per_s[0]), 0.1);  // it was hit
}

TEST(EnsembleBodies, TheirListsAreRegrownWithoutATrace) {
  // The wheel comes down on a bed of which it saw nothing at first.
  Body wheel = Wheel(false);
  wheel.position_m[2] += 0.006;
  wheel.velocity_m_per_s = {0, 0, -2};
  Worlds worlds;
  worlds.push_back(WithBodies(4, {Floor(), wheel}));
  const auto device = EmulatedDevice();
  Ensemble all = Together(worlds, *device, {24, 60, 40});
  all.Run(600);
  EXPECT_GT(all.regrowths(), 0);
  ASSERT_EQ(worlds[0]->Run(600), StepFault::kNone);
  ExpectSame(all.Grains(0), Of(*worlds[0]));
  ExpectSameBodies(all, 0, *worlds[0]);
}

TEST(EnsembleBodies, AGrainThatIsShotThroughEndsItsWorldAlone) {
  Worlds worlds;
  Body fast = Wheel(false);
  fast.velocity_m_per_s = {0, 0, -60};
  worlds.push_back(WithBodies(5, {Floor(), fast}));
  worlds.push_back(WithBodies(6, {Floor(), Wheel(false)}));
  const auto device = EmulatedDevice();
  Ensemble all = Together(worlds, *device);
  all.Run(100);
  EXPECT_NE(worlds[0]->Run(100), StepFault::kNone);
  EXPECT_EQ(all.fault(0), worlds[0]->fault());
  EXPECT_EQ(static_cast<std::uint64_t>(all.steps(0)), worlds[0]->steps());
  EXPECT_EQ(all.fault(1), StepFault::kNone);
  EXPECT_EQ(all.steps(1), 100);
}

TEST(EnsembleBodies, WorldsWaitAtTheirStep) {
  Worlds worlds;
  worlds.push_back(WithBodies(1, {Floor(), Wheel(false)}));
  worlds.push_back(WithBodies(2, {Floor(), Wheel(true)}));
  const auto device = EmulatedDevice();
  Ensemble all = Together(worlds, *device);
  all.RunTo({70, 250});
  EXPECT_EQ(all.steps(0), 70);
  EXPECT_EQ(all.steps(1), 250);
  ASSERT_EQ(worlds[0]->Run(70), StepFault::kNone);
  ASSERT_EQ(worlds[1]->Run(250), StepFault::kNone);
  for (int k = 0; k < 2; ++k) ExpectSame(all.Grains(k), Of(*worlds[k]));
}

TEST(EnsembleBodies, SortsOnTheWayAreThoseOfTheCpu) {
  Worlds worlds;
  for (const int every : {150, 0, 130}) {
    Contents contents;
    contents.grains = Bed(3 + every);
    // Listed from all over the bed, so that a sort has much to do.
    for (GrainState& g : contents.grains) g.v_x += 0.15 * std::sin(400 * g.z_m);
    contents.bodies = {Floor(), Wheel(every == 130)};
    WorldConfig config = OnFloor();
    config.energy = every != 130;
    config.sort_steps = every;
    worlds.push_back(std::make_unique<World>(config, contents));
  }
  const auto device = EmulatedDevice();
  Ensemble all = Together(worlds, *device, {4, 8, 7});  // sorts that overflow, too
  const std::vector<Grain> before = all.Grains(0);
  all.RunTo({450, 500, 70});
  all.RunTo({901, 900, 900});
  EXPECT_GT(all.sorts(), 6);
  EXPECT_GT(all.regrowths(), 0);
  ASSERT_EQ(worlds[0]->Run(901), StepFault::kNone);
  for (const int k : {1, 2}) ASSERT_EQ(worlds[k]->Run(900), StepFault::kNone);
  for (int k = 0; k < 3; ++k) {
    ExpectSame(all.Grains(k), Of(*worlds[k]));
    ExpectSameBodies(all, k, *worlds[k]);
    EXPECT_EQ(all.rebuilds(k), static_cast<std::int32_t>(worlds[k]->rebuilds()));
  }
  std::size_t moved = 0;
  for (std::size_t i = 0; i < before.size(); ++i) moved += before[i].id != all.Grains(0)[i].id;
  EXPECT_GT(moved, 20u);
  const EnergyBalance cpu = worlds[0]->Balance();
  all.Pull(0);
  const EnergyBalance device_balance = worlds[0]->Balance();
  EXPECT_NEAR(device_balance.Total(), cpu.Total(), 1e-6 * cpu.kinetic);
  EXPECT_GT(cpu.slip, 0);
}

/// Grains in the lower half stop; some of them move again later.
std::vector<std::uint8_t> Lower(const World& w, double height_m) {
  std::vector<std::uint8_t> out(w.count());
  for (std::int64_t i = 0; i < w.count(); ++i) out[i] = w.State(i).z_m < height_m;
  return out;
}

/// Clumps of three kinds that fall on a bed of single grains, some spinning.
Contents Rubble(int seed) {
  Contents c;
  c.grains = Bed(seed);
  c.bodies = {Floor()};
  c.templates.push_back(MakeClump({{{0, 0, 0}, 1e-3}, {{1.2e-3, 0, 0}, 1e-3}}));
  c.templates.push_back(
      MakeClump({{{0, 0, 0}, 1e-3}, {{1e-3, 0, 0}, 8e-4}, {{0, 1e-3, 3e-4}, 9e-4}}));
  for (int k = 0; k < 60; ++k) {
    ClumpState s;
    s.shape = k % 2;
    s.density_kg_per_m3 = 2600;
    s.position_m = {0.002 + 0.0045 * (k % 6), 0.002 + 0.0045 * (k / 6 % 5),
                    0.0185 + 0.004 * (k / 30)};
    s.orientation = {1, 0.1 * k, 0.3, -0.05 * k};
    s.velocity_m_per_s = {0.05, 0, -0.4};
    s.spin_rad_per_s = {3.0 * (k % 5), 0, -20};
    c.clumps.push_back(s);
  }
  return c;
}

TEST(EnsembleClumps, MoveAsOnTheCpu) {
  Worlds worlds, same;
  for (Worlds* all : {&worlds, &same}) {
    all->push_back(std::make_unique<World>(OnFloor(), Rubble(11)));
    all->push_back(WithBodies(12, {Floor(), Wheel(true)}));
    all->push_back(std::make_unique<World>(OnFloor(), Rubble(13)));
  }
  const auto device = EmulatedDevice();
  Ensemble all = Together(worlds, *device, {2, 6, 3});  // they have to be regrown
  all.Run(900);
  EXPECT_GT(all.regrowths(), 0);
  for (const int k : {0, 2}) {
    World& cpu = *same[k];
    ASSERT_EQ(cpu.Run(900), StepFault::kNone);
    EXPECT_EQ(all.fault(k), StepFault::kNone);
    ExpectSame(all.Grains(k), Of(cpu));
    all.Pull(k);
    const ClumpState a = worlds[k]->Clump(7), b = cpu.Clump(7);
    EXPECT_EQ(a.position_m, b.position_m);
    EXPECT_EQ(a.orientation, b.orientation);
    EXPECT_EQ(worlds[k]->KineticEnergy(), cpu.KineticEnergy());
    EXPECT_GT(std::abs(a.position_m[2] - 0.0185), 1e-3);  // it moved
  }
  same[0]->ImportState(same[0]->ExportState());
  for (World* w : {worlds[0].get(), same[0].get()}) {
    w->SetGravity({1, 0, -3});
    w->SetDrag(0.999);
  }
  all.Push(0);
  same[0]->ImportState(same[0]->ExportState());
  all.Run(200);
  ASSERT_EQ(same[0]->Run(200), StepFault::kNone);
  ExpectSame(all.Grains(0), Of(*same[0]));
}

TEST(EnsembleTransfer, AWorldThatIsChangedOnTheWayGoesOnAsOnTheCpu) {
  Worlds worlds, same;
  for (Worlds* all : {&worlds, &same}) {
    all->push_back(WithBodies(7, {Floor(), Wheel(false)}));
    all->push_back(WithBodies(8, {Floor(), Wheel(true)}));
  }
  const auto device = EmulatedDevice();
  Ensemble all = Together(worlds, *device);
  Ensemble untouched = Together(same, *device);
  World cpu_of_0(OnFloor(), [] {
    Contents c;
    c.grains = Bed(7);
    c.bodies = {Floor(), Wheel(false)};
    return c;
  }());
  const auto both = [&](auto&& change) {
    all.Pull(0);
    cpu_of_0.ImportState(cpu_of_0.ExportState());  // as pulling does, a search
    change(*worlds[0]);
    change(cpu_of_0);
    all.Push(0);
    cpu_of_0.ImportState(cpu_of_0.ExportState());
    ExpectSame(all.Grains(0), Of(cpu_of_0));
    all.Run(150);
    ASSERT_EQ(cpu_of_0.Run(150), StepFault::kNone);
    ExpectSame(all.Grains(0), Of(cpu_of_0));
    ExpectSameBodies(all, 0, cpu_of_0);
  };
  all.Run(150);
  cpu_of_0.Run(150);
  both([](World& w) { w.Freeze(Lower(w, 0.012)); });
  EXPECT_TRUE(cpu_of_0.Frozen(0) || cpu_of_0.Frozen(cpu_of_0.count() - 1));
  both([](World& w) { w.Freeze(Lower(w, 0.006)); });
  both([](World& w) {  // fewer grains, one new
    GrainExchange e;
    for (std::int64_t i = 0; i < w.count(); ++i) {
      if (w.State(i).x_m > 0.024 && w.State(i).z_m > 0.012) e.out.push_back(w.grains()[i].id);
    }
    GrainState g = {};
    g.x_m = 0.027, g.y_m = 0.01, g.z_m = 0.03, g.radius_m = 0.001, g.density_kg_per_m3 = 2600;
    e.in.push_back(g);
    w.Exchange(e);
  });
  both([](World& w) {  // more grains than the device has room for
    GrainExchange e;
    for (int k = 0; k < 400; ++k) {
      GrainState g = {};
      g.x_m = 0.0015 + 0.0025 * (k % 11), g.y_m = 0.0015 + 0.0025 * (k / 11 % 9);
      g.z_m = 0.04 + 0.0025 * (k / 99), g.radius_m = 0.001, g.density_kg_per_m3 = 2600;
      e.in.push_back(g);
    }
    w.Exchange(e);
  });
  // Its batch-mate saw nothing of all that.
  untouched.Run(all.steps(1));
  ExpectSame(all.Grains(1), untouched.Grains(1));
}

TEST(EnsembleTransfer, BooksTheEnergyOfTheCpu) {
  Worlds worlds;
  worlds.push_back(WithBodies(9, {Floor(), Wheel(true)}, true));
  worlds.push_back(WithBodies(10, {Floor(), Wheel(false)}, false));
  const auto device = EmulatedDevice();
  Ensemble all = Together(worlds, *device);
  const auto cpu = WithBodies(9, {Floor(), Wheel(true)}, true);
  all.Run(300);
  all.Pull(0);
  const double once = worlds[0]->Balance().slip;
  all.Pull(0);
  EXPECT_EQ(worlds[0]->Balance().slip, once);  // not booked twice
  all.Push(0);
  all.Run(300);
  all.Pull(0);
  cpu->Run(300);
  cpu->ImportState(cpu->ExportState());
  cpu->ImportState(cpu->ExportState());
  cpu->Run(300);
  const EnergyBalance a = cpu->Balance(), b = worlds[0]->Balance();
  const double scale = a.slip + a.normal_damping;
  EXPECT_GT(a.slip, 0.05 * scale);
  EXPECT_NEAR(a.kinetic, b.kinetic, 1e-6 * scale);
  EXPECT_NEAR(a.stored, b.stored, 1e-6 * scale);
  EXPECT_NEAR(a.normal_damping, b.normal_damping, 1e-6 * scale);
  EXPECT_NEAR(a.tangent_damping, b.tangent_damping, 1e-6 * scale);
  EXPECT_NEAR(a.slip, b.slip, 1e-6 * scale);
  EXPECT_NEAR(a.rolling, b.rolling, 1e-6 * scale);
  EXPECT_NEAR(a.body_work, b.body_work, 1e-6 * scale);
  EXPECT_NEAR(a.Total(), b.Total(), 1e-6 * scale);
}

TEST(EnsembleTransfer, WhatDoesNotFitIsRefusedWithSizes) {
  Worlds worlds;
  worlds.push_back(WithBodies(1, {Floor(), Wheel(false)}));
  constexpr std::size_t kAmple = std::size_t{1} << 30;
  const auto ample = EmulatedDevice(kAmple);
  std::size_t needed = 0;
  {
    const Ensemble all = Together(worlds, *ample);
    needed = all.Plan().Total();
    const auto taken = static_cast<double>(kAmple - ample->FreeBytes());
    EXPECT_NEAR(static_cast<double>(needed), taken, 0.02 * taken);  // the plan is true
  }
  EXPECT_EQ(ample->FreeBytes(), kAmple);  // all was given back
  const auto small = EmulatedDevice(needed / 2);
  try {
    Together(worlds, *small);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("MiB on emulated"), std::string::npos) << error.what();
  }
  const auto enough = EmulatedDevice(needed + needed / 4);
  Together(worlds, *enough).Run(3);
}

TEST(EnsembleTransfer, RefusesAMesh) {
  TriangleSoup soup;
  soup.vertices = {{0, 0, 0}, {0.01, 0, 0}, {0, 0.01, 0}};
  soup.triangles = {{0, 1, 2}};
  Body sheet;
  sheet.shape = FromMesh(std::make_shared<Mesh>(soup));
  sheet.position_m = {0.01, 0.01, 0.05};
  Worlds worlds;
  worlds.push_back(WithBodies(1, {sheet}));
  const auto device = EmulatedDevice();
  try {
    Together(worlds, *device);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("world 0: a mesh"), std::string::npos);
  }
}

}  // namespace
}  // namespace grouser::dem::gpu
