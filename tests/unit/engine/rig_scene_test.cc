// The bed of a wheel test: tiles in a row, the window that follows, freezing.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "dem_offline/engine/rig/bed_feed.h"
#include "dem_offline/engine/rig/freezer.h"
#include "dem_offline/engine/rig/materials.h"
#include "dem_offline/engine/rig/scaling.h"
#include "dem_offline/engine/rig/scene.h"
#include "dem_offline/engine/rig/steady.h"
#include "dem_offline/engine/rig/window.h"
#include "tests/unit/engine/rig_testing.h"

namespace grouser::dem {
namespace {

constexpr double kDt = 1e-4;

int Words() {
  const WheelTestSpec s = Small();
  return RigContacts(s.soil, s.wheel).layout().words;
}

double Mass(const World& w) {
  double sum = 0;
  for (std::int64_t i = 0; i < w.count(); ++i) sum += w.grains()[i].mass;
  return sum;
}

/// Kinetic energy over m g d of all grains.
double Unrest(const World& w) { return w.KineticEnergy() / (Mass(w) * 9.81 * 0.012); }

/// Contacts per grain, outside the window's band.
double Coordination(const World& w, const Window& window) {
  double sum = 0, n = 0;
  for (std::int64_t i = 0; i < w.count(); ++i) {
    if (window.InBand(w.grains()[i].x)) continue;
    sum += w.loads()[i].touching;
    n += 1;
  }
  return sum / n;
}

/// Largest distance [m] of a grain from the nearest place that the tile has.
double Strayed(const World& w, const BedPiece& bed) {
  double furthest = 0;
  for (std::int64_t i = 0; i < w.count(); ++i) {
    const GrainState g = w.State(i);
    double nearest = 1;
    for (const GrainState& h : bed.grains) {
      const double dx = std::remainder(g.x_m - h.x_m, 0.2), dy = std::remainder(g.y_m - h.y_m, 0.1);
      nearest = std::min(nearest, std::hypot(dx, dy, g.z_m - h.z_m));
    }
    furthest = std::max(furthest, nearest);
  }
  return furthest;
}

TEST(BedFeed, PiecesSideBySideMakeTheBed) {
  const BedFeed feed(SmallTile(), 2290, Words());
  const auto n = SmallTile().radius_m.size();
  EXPECT_EQ(feed.Between(0, 0.2).grains.size(), n);
  EXPECT_EQ(feed.Between(-0.2, 0.4).grains.size(), 3 * n);
  std::set<std::pair<int, int>> seen;
  std::size_t count = 0;
  const double planes[] = {-0.31, -0.2, -0.013, 0, 0.05, 0.0500001, 0.2, 0.29};
  for (int k = 0; k + 1 < 8; ++k) {
    const BedPiece p = feed.Between(planes[k], planes[k + 1]);
    for (std::size_t i = 0; i < p.tile_places.size(); ++i) {
      EXPECT_GE(p.grains[i].x_m, planes[k]);
      EXPECT_LT(p.grains[i].x_m, planes[k + 1]);
      seen.insert({p.tile_places[i].grain, p.tile_places[i].copy});
    }
    count += p.tile_places.size();
  }
  EXPECT_EQ(seen.size(), count);  // none twice
  EXPECT_EQ(count, 3 * n);        // none missed: 0.6 m are three tiles
  EXPECT_TRUE(feed.Between(0.1, 0.1).grains.empty());
}

TEST(BedFeed, ContactsJoinGrainsThatTouch) {
  const BedFeed feed(SmallTile(), 2290, Words());
  const BedPiece p = feed.Between(0.15, 0.37);  // across a copy's end
  std::size_t inside = 0, across = 0;
  for (const BedTouch& t : p.touches) {
    EXPECT_TRUE(t.in_a >= 0 || t.in_b >= 0);
    const double dx = feed.XOf(t.a) - feed.XOf(t.b);
    EXPECT_LT(std::abs(dx), 0.0121);
    if (t.in_a >= 0) {
      EXPECT_EQ(p.tile_places[t.in_a], t.a);
    }
    if (t.in_b >= 0) {
      EXPECT_EQ(p.tile_places[t.in_b], t.b);
    }
    ++(t.in_a >= 0 && t.in_b >= 0 ? inside : across);
  }
  EXPECT_GT(inside, p.grains.size());  // coordination above 2
  EXPECT_GT(across, 0u);
  EXPECT_FALSE(p.floor.empty());
}

TEST(BedFeed, RefusesTheHistoriesOfOtherLaws) {
  EXPECT_THROW(BedFeed(SmallTile(), 2290, Words() + 1), std::invalid_argument);
}

TEST(RigScene, TilesInARowStayAtRest) {
  WheelTestSpec s = Small();
  RigScene one(s, SmallTile(), kDt);
  s.rig.scene.bed = SceneBed::kFull;
  s.rig.max_time_s = 4;  // 0.4 m: three tiles
  RigScene row(s, SmallTile(), kDt);
  EXPECT_EQ(row.world().count(), 3 * one.world().count());
  ASSERT_EQ(one.world().Run(300), StepFault::kNone);
  ASSERT_EQ(row.world().Run(300), StepFault::kNone);
  EXPECT_LT(Unrest(row.world()), 1.5 * Unrest(one.world()) + 1e-12);
  EXPECT_NEAR(row.world().MeanContacts(), one.world().MeanContacts(), 1e-3);
  EXPECT_NEAR(row.world().MeanContacts(), SmallTile().coordination, 0.05);
}

/// Runs an unloaded window on by `path` and leaves it active but for the band.
void Roll(RigScene& scene, double path) {
  const double step = 0.004;
  std::uint64_t steps = 0;
  for (double x = 0; x < path; x += step) {
    for (int k = 0; k < 50; ++k) {
      scene.Follow(steps++, {scene.start_x_m() + x, 0.05, 0.04});
      ASSERT_EQ(scene.world().Step(), StepFault::kNone);
    }
  }
}

TEST(Window, LeavesAnUnloadedBedAtRest) {
  WheelTestSpec s = Small();
  s.rig.scene.bed = SceneBed::kWindow;
  s.rig.scene.window_length_m = s.rig.bed_length_m;
  RigScene scene(s, SmallTile(), kDt);
  World& w = scene.world();
  RigScene still(Small(), SmallTile(), kDt);
  double unrest = 0;  // the liveliest that a bed left alone gets
  for (int k = 0; k < 25; ++k) {
    ASSERT_EQ(still.world().Run(200), StepFault::kNone);
    unrest = std::max(unrest, Unrest(still.world()));
  }
  const double mass = Mass(w);
  Roll(scene, 0.5);
  EXPECT_GT(scene.window()->slabs(), 15u);
  EXPECT_GT(scene.window()->from_m(), 0.4);
  EXPECT_NEAR(Mass(w) / mass, 1, 0.02);
  EXPECT_LT(Unrest(w), 2 * unrest + 1e-8);
  EXPECT_LT(unrest, 1e-6);
  const Window& window = *scene.window();  // as long as the tile: x means the same in both
  EXPECT_NEAR(Coordination(w, window), Coordination(still.world(), window), 0.03);
  // Every grain stands where the tile has one, as in a bed that was left alone.
  const BedFeed feed(SmallTile(), 2290, Words());
  const BedPiece here = feed.Between(scene.window()->from_m(), scene.window()->to_m());
  EXPECT_EQ(static_cast<std::size_t>(w.count()), here.grains.size());
  EXPECT_LT(Strayed(w, here), Strayed(still.world(), here) + 0.02 * 0.012);
}

TEST(Window, IsTheSameEachTime) {
  std::uint64_t hash[2];
  for (auto& h : hash) {
    WheelTestSpec s = Small();
    s.rig.scene.bed = SceneBed::kWindow;
    s.rig.scene.freeze = true;
    RigScene scene(s, SmallTile(), kDt);
    Roll(scene, 0.1);
    h = scene.world().Hash();
  }
  EXPECT_EQ(hash[0], hash[1]);
}

TEST(Window, MayHaveAnyLengthButNotTooShort) {
  WheelTestSpec s = Small();
  s.rig.scene.bed = SceneBed::kWindow;
  s.rig.scene.window_length_m = 0.27;
  RigScene scene(s, SmallTile(), kDt);
  Roll(scene, 0.3);
  EXPECT_LT(Unrest(scene.world()), 1e-6);
  s.rig.scene.window_length_m = 0.1;
  EXPECT_THROW(RigScene(s, SmallTile(), kDt), std::invalid_argument);
}

TEST(Freezer, RestsOutsideTheBoxAndWakesForBoxAndNeighbour) {
  WheelTestSpec s = Small();
  RigScene scene(s, SmallTile(), kDt);
  World& w = scene.world();
  FreezerSettings f;
  f.half_m = {0.03, 0.03, 1};
  f.quiet_m_per_s = 1e-3;
  f.disturb_m_per_s = 2e-3;
  f.cell_m = 0.0132;
  Freezer freezer(f);
  std::vector<std::uint8_t> frozen;
  const auto nobody = [](const Grain&) { return false; };
  const auto look = [&](Vec3d hub) {
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(w.Run(20), StepFault::kNone);
      freezer.Look(w, hub, 20 * kDt, nobody, &frozen);
      w.Freeze(frozen);
    }
  };
  const auto active = [&](double x) {  // in the column around x, middle of the width
    int n = 0;
    for (std::int64_t i = 0; i < w.count(); ++i) {
      const GrainState g = w.State(i);
      n += std::hypot(g.x_m - x, g.y_m - 0.05) < 0.02 && !w.Frozen(i);
    }
    return n;
  };
  look({0.05, 0.05, 0.04});
  EXPECT_GT(active(0.05), 5);
  EXPECT_EQ(active(0.15), 0);
  look({0.15, 0.05, 0.04});
  EXPECT_GT(active(0.15), 5);
  EXPECT_EQ(active(0.05), 0);
  // A grain that is thrown at the frozen part makes it active.
  std::int32_t id = -1;
  for (std::int64_t i = 0; i < w.count() && id < 0; ++i) {
    const GrainState g = w.State(i);
    if (!w.Frozen(i) && std::abs(g.x_m - 0.125) < 0.006 && g.z_m > -0.02) id = w.grains()[i].id;
  }
  ASSERT_GE(id, 0);
  w.SetVelocity(id, {-0.5, 0, 0}, {0, 0, 0});
  ASSERT_EQ(w.Run(20), StepFault::kNone);
  freezer.Look(w, {0.15, 0.05, 0.04}, 20 * kDt, nobody, &frozen);
  int woken = 0;
  for (std::int64_t i = 0; i < w.count(); ++i) woken += w.Frozen(i) && !frozen[i];
  EXPECT_GT(woken, 0);
}

TEST(Stopping, NeedsTravelPrecisionAndNoDrift) {
  EXPECT_NEAR(ContactLength(0.0625, 0.018), 0.0625 * std::acos(1 - 0.288), 1e-12);
  EXPECT_EQ(ContactLength(0.0625, -0.001), 0);
  Series s;
  for (int i = 0; i < 2000; ++i) {
    s.time_s.push_back(1e-3 * i);
    s.f_x_n.push_back(std::sin(1.7 * i));
    s.f_y_n.push_back(std::cos(2.3 * i));
    s.f_z_n.push_back(24);
    s.torque_n_m.push_back(0.1);
    s.sinkage_m.push_back(0.018);
    s.travel_m.push_back(1e-5 * i);
  }
  const SteadyRule rule{24, 0.0625, 0.02};
  SteadyWindow w = FindSteady(s, 0, rule);
  EXPECT_TRUE(w.precise && w.drift_free);
  EXPECT_FALSE(w.Enough());  // 15 mm of 48 mm
  for (auto& x : s.travel_m) x *= 4;
  w = FindSteady(s, 0, rule);
  EXPECT_TRUE(w.Enough());
  EXPECT_NEAR(w.travel_m, 0.06, 1e-3);
  for (int i = 0; i < 2000; ++i) s.f_y_n[i] += 24 * std::sin(0.02 * i);
  EXPECT_FALSE(FindSteady(s, 0, rule).Enough());
}

TEST(Scaling, OverlapUnderTheWheelIsThatOfHertz) {
  const WheelShape wheel;
  GrainSoil soil;
  soil.sizes = {{0.009, 1.0}};
  soil.youngs_modulus_pa = 2e7;
  const double pressure = MeanPressure(wheel, 40, 0.2 * wheel.radius_m);
  const double effective = soil.youngs_modulus_pa / (2 * (1 - 0.3 * 0.3));
  EXPECT_NEAR(LoadedOverlap(soil, wheel, 40) / (2.6 * std::pow(pressure / effective, 2.0 / 3)), 1,
              0.03);
  EXPECT_NEAR(MeanPressure(wheel, 80, 0.015) / MeanPressure(wheel, 40, 0.015), 2, 1e-9);
  EXPECT_THROW(MeanPressure(wheel, 0, 0.015), std::invalid_argument);
  EXPECT_THROW(MeanPressure(wheel, 40, 0), std::invalid_argument);
}

TEST(Scaling, LargestStepIsThatOfTheWorldsCriticalStep) {
  const WheelTestSpec s = Small();
  RigScene scene(s, SmallTile(), kDt);
  const double ratio = LargestStep(s.soil, s.wheel, 0.05) / scene.world().CriticalStep(0.05);
  EXPECT_GT(ratio, 0.5);
  EXPECT_NEAR(ratio, LargestStep(s.soil, s.wheel, 0.01) / scene.world().CriticalStep(0.01), 1e-4);
  WheelTestSpec dull = s;
  dull.soil.restitution = 0.2;
  EXPECT_LT(LargestStep(dull.soil, s.wheel, 0.05), 0.7 * LargestStep(s.soil, s.wheel, 0.05));
  EXPECT_GT(LoadedOverlap(s.soil, s.wheel, 12), LoadedOverlap(s.soil, s.wheel, 6));
  WheelTestSpec stiff = s;
  stiff.soil.youngs_modulus_pa *= 4;
  EXPECT_NEAR(LargestStep(stiff.soil, s.wheel, 0.05) / LargestStep(s.soil, s.wheel, 0.05), 0.5,
              1e-3);
}

/// Linear springs of this stiffness and share of critical damping.
WheelTestSpec Linear(double stiffness, double damping) {
  WheelTestSpec s = Small();
  s.soil.contact.normal = "linear_spring";
  s.soil.contact.tangential = "linear_history";
  s.soil.contact.settings = {{"linear_spring", "stiffness_n_per_m", stiffness},
                             {"linear_spring", "critical_damping_share", damping}};
  return s;
}

TEST(Scaling, StepsAskTheLawNotYoungsModulus) {
  const WheelTestSpec soft = Linear(1e3, 0.1);
  const double overlap = LoadedOverlap(soft.soil, soft.wheel, soft.state.load_n);
  const double step = LargestStep(soft.soil, soft.wheel, overlap);
  WheelTestSpec s = soft;
  s.soil.youngs_modulus_pa *= 100;  // no part of a linear spring
  s.soil.restitution = 0.01;
  EXPECT_DOUBLE_EQ(LoadedOverlap(s.soil, s.wheel, s.state.load_n), overlap);
  EXPECT_DOUBLE_EQ(LargestStep(s.soil, s.wheel, overlap), step);
  s = Linear(4e3, 0.1);
  EXPECT_NEAR(LoadedOverlap(s.soil, s.wheel, s.state.load_n) / overlap, 0.25, 1e-5);
  EXPECT_NEAR(LargestStep(s.soil, s.wheel, overlap) / step, 0.5, 1e-6);
  s = Linear(1e3, 1.0);  // critical
  EXPECT_LT(LargestStep(s.soil, s.wheel, overlap), 0.5 * step);
}

TEST(Scaling, AShareOfTheRayleighTimeIsCutToWhatTheLawsBear) {
  const WheelTestSpec usual = Small();
  const double rayleigh = RayleighTime(SmallestRadius(usual.soil), usual.soil.density_kg_per_m3,
                                       usual.soil.youngs_modulus_pa, usual.soil.poisson_ratio);
  EXPECT_DOUBLE_EQ(StepWithin(usual.soil, usual.wheel, 0.2, 0.03), 0.2 * rayleigh);
  const WheelTestSpec stiff = Linear(1e6, 0.1);
  EXPECT_LT(StepWithin(stiff.soil, stiff.wheel, 0.2, 0.03), 0.05 * rayleigh);
  WheelTestSpec torque = usual;
  torque.soil.contact.rolling = "constant_torque";
  EXPECT_LT(StepWithin(torque.soil, torque.wheel, 0.2, 0.03), 0.15 * rayleigh);
}

/// Velocity after an elastic or damped impact of a grain on the bed's bodies.
TEST(RigContacts, EachInterfaceHasItsOwnNumbers) {
  WheelTestSpec s = Linear(1e4, 0.2);
  s.soil.contact.wheel.settings = {{"linear_spring", "critical_damping_share", 0.9}};
  s.soil.contact.floor.settings = {{"linear_spring", "stiffness_n_per_m", 4e4}};
  s.soil.contact.floor.rolling_damping = 0.7;
  s.soil.contact.rolling = "epsd";
  const ContactModel model = RigContacts(s.soil, s.wheel);
  const auto normal = [&](int other) {
    return ParamsOf<LinearSpring>(
        static_cast<const NormalLaws::Params&>(model.Table()[kGrainMaterial * 3 + other]));
  };
  EXPECT_FLOAT_EQ(normal(kGrainMaterial).damping, 0.4f);
  EXPECT_FLOAT_EQ(normal(kFloorMaterial).damping, 0.4f);
  EXPECT_FLOAT_EQ(normal(kWheelMaterial).damping, 1.8f);
  EXPECT_FLOAT_EQ(normal(kGrainMaterial).flex, 1e-4f);
  EXPECT_FLOAT_EQ(normal(kFloorMaterial).flex, 0.25e-4f);
  EXPECT_FLOAT_EQ(normal(kWheelMaterial).flex, 1e-4f);
  const auto rolling = [&](int other) {
    return ParamsOf<RollingEpsd>(
        static_cast<const RollingLaws::Params&>(model.Table()[kGrainMaterial * 3 + other]));
  };
  EXPECT_FLOAT_EQ(rolling(kFloorMaterial).damping, 0.7f);
  EXPECT_FLOAT_EQ(rolling(kWheelMaterial).damping, 0.3f);
}

TEST(RigContacts, BadNumbersOfAnInterfaceAreRefusedByName) {
  WheelTestSpec s = Linear(1e4, 0.2);
  s.soil.contact.wheel.rolling_damping = -1;
  try {
    ValidateSpec(s);
    ADD_FAILURE() << "was accepted";
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("soil.grains.contact.wheel.rolling_damping"),
              std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace grouser::dem
