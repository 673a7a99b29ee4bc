// Grains that freeze, move again, leave and come while a world runs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "dem_offline/engine/laws/contact_model.h"
#include "dem_offline/engine/world/world.h"
#include "tests/unit/engine/laws_per_pair.h"

namespace grouser::dem {
namespace {

constexpr double kLength = 0.06, kWidth = 0.05;

WorldConfig ChangeConfig() {
  WorldConfig c;
  c.frame = {kLength, kWidth, 1.0};
  c.dt_s = 2e-5;
  c.contacts = OneMaterial({1e7, 0.3}, {0.5, 0.5, 0.1});
  c.energy = true;
  return c;
}

Body Floor() {
  Body floor;
  const double up[3] = {0, 0, 1};
  floor.shape = HalfSpace(up);
  return floor;
}

/// A bed at rest, made once.
const std::vector<GrainState>& Bed() {
  static const std::vector<GrainState> bed = [] {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> u(-1, 1);
    std::vector<GrainState> grains;
    for (int k = 0; k < 600; ++k) {
      GrainState g = {};
      g.x_m = (k % 12 + 0.5) * kLength / 12 + 2e-4 * u(random);
      g.y_m = (k / 12 % 10 + 0.5) * kWidth / 10 + 2e-4 * u(random);
      g.z_m = 0.0026 + 0.005 * (k / 120);
      g.radius_m = 0.0021 + 0.0002 * u(random);
      g.density_kg_per_m3 = 2500;
      grains.push_back(g);
    }
    World world(ChangeConfig(), grains);
    world.AddBody(Floor());
    world.SetDrag(0.998);
    world.Run(20000);
    world.SetDrag(1);
    world.Run(20000);
    for (std::int64_t i = 0; i < world.count(); ++i) {
      const std::int32_t id = world.grains()[i].id;
      grains[id] = world.State(i);
      GrainState& g = grains[id];
      g.v_x = g.v_y = g.v_z = g.w_x = g.w_y = g.w_z = 0;
    }
    return grains;
  }();
  return bed;
}

World& Settled(World& world) {
  world.AddBody(Floor());
  world.SetDrag(0.998);
  world.Run(5000);  // the histories come back
  world.SetDrag(1);
  world.Run(5000);
  return world;
}

double Highest(const World& world) {
  double top = -1;
  for (std::int64_t i = 0; i < world.count(); ++i) top = std::max(top, world.State(i).z_m);
  return top;
}

TEST(Freeze, TheFrozenStayAndTheirNeighboursRestOnThem) {
  World world(ChangeConfig(), Bed());
  Settled(world);
  const double top = Highest(world);
  std::vector<std::uint8_t> frozen(world.count());
  for (std::int64_t i = 0; i < world.count(); ++i) frozen[i] = world.State(i).z_m < 0.008;
  const std::int64_t all = world.pairs_listed();
  world.Freeze(frozen);
  EXPECT_LT(world.pairs_listed(), all);
  const std::vector<Grain> before = world.grains();
  ASSERT_EQ(world.Run(3000), StepFault::kNone);
  for (std::int64_t i = 0; i < world.count(); ++i) {
    if (!frozen[i]) continue;
    EXPECT_EQ(world.grains()[i].z, before[i].z);
    EXPECT_TRUE(world.Frozen(i));
  }
  EXPECT_NEAR(Highest(world), top, 1e-6);
}

TEST(Freeze, TheWokenAreInEquilibriumStill) {
  World world(ChangeConfig(), Bed());
  Settled(world);
  const double top = Highest(world), mean = world.MeanContacts(), stir = world.KineticEnergy();
  world.Freeze(std::vector<std::uint8_t>(world.count(), 1));
  EXPECT_EQ(world.pairs_listed(), 0);
  world.Run(2000);
  world.Freeze(std::vector<std::uint8_t>(world.count(), 0));
  ASSERT_EQ(world.Run(200), StepFault::kNone);
  EXPECT_LT(world.KineticEnergy(), stir);  // it lost what motion it had and found none
  EXPECT_NEAR(Highest(world), top, 1e-6);
  EXPECT_NEAR(world.MeanContacts(), mean, 0.02);
}

TEST(Freeze, HistoriesOfFrozenPairsSurviveSearches) {
  World world(ChangeConfig(), Bed());
  Settled(world);
  using Histories = std::map<std::pair<std::int32_t, std::int32_t>, std::vector<float>>;
  const auto of = [&](const std::vector<std::uint8_t>& flags) {
    Histories out;
    world.list().ForEachHistory([&](std::int32_t i, std::int32_t j, const float* words) {
      if (flags[i] && flags[j]) out[{i, j}].assign(words, words + world.list().words());
    });
    return out;
  };
  std::vector<std::uint8_t> low(world.count());
  for (std::int64_t i = 0; i < world.count(); ++i) low[i] = world.State(i).z_m < 0.008;
  const Histories before = of(low);
  ASSERT_GT(before.size(), 300u);
  const std::int64_t pairs = world.list().pairs();
  world.Freeze(std::vector<std::uint8_t>(world.count(), 1));
  world.Freeze(low);  // the others move again: a search, without the pairs of frozen grains
  EXPECT_LT(world.list().pairs(), pairs - static_cast<std::int64_t>(before.size()));
  EXPECT_EQ(of(low), before);
  const std::uint64_t searches = world.rebuilds();
  std::int64_t top = 0;
  for (std::int64_t i = 0; i < world.count(); ++i) {
    if (world.State(i).z_m > world.State(top).z_m) top = i;
  }
  world.SetVelocity(world.grains()[top].id, {0, 0, 0.5}, {0, 0, 0});
  world.Run(500);
  ASSERT_GT(world.rebuilds(), searches);
  EXPECT_EQ(of(low), before);
  world.Freeze(std::vector<std::uint8_t>(world.count(), 0));
  const Histories after = of(low);  // evaluated once, which brings slipping springs to their limit
  ASSERT_EQ(after.size(), before.size());
  std::size_t same = 0;
  for (const auto& [pair, words] : before) {
    bool close = true;
    for (std::size_t w = 0; w < words.size(); ++w) {
      close &= std::abs(after.at(pair)[w] - words[w]) <= 1e-3f * std::abs(words[w]) + 1e-9f;
    }
    same += close ? 1 : 0;
  }
  EXPECT_GT(same, before.size() * 9 / 10);
}

TEST(Freeze, EnergyIsAccountedFor) {
  std::vector<GrainState> moving = Bed();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-0.05, 0.05);
  for (GrainState& g : moving) g.v_x = u(random), g.v_y = u(random), g.v_z = u(random);
  World world(ChangeConfig(), moving);
  world.AddBody(Floor());
  world.Run(500);
  const double kinetic = world.KineticEnergy(), total = world.Balance().Total();
  std::vector<std::uint8_t> frozen(world.count());
  for (std::int64_t i = 0; i < world.count(); ++i) frozen[i] = i % 3 != 0;
  world.Freeze(frozen);
  EXPECT_GT(world.Balance().frozen, 0.1 * kinetic);
  world.Run(500);
  world.Freeze(std::vector<std::uint8_t>(world.count(), 0));
  world.Run(500);
  EXPECT_NEAR(world.Balance().Total(), total, 0.02 * kinetic);
}

/// The same grains out and in again, with their histories: as if nothing was.
TEST(Exchange, WhatLeavesAndComesBackLeavesNoTrace) {
  World world(ChangeConfig(), Bed()), twin(ChangeConfig(), Bed());
  Settled(world);
  Settled(twin);
  GrainExchange e;
  std::vector<std::int32_t> number(world.count(), -1);  // by place
  for (std::int64_t i = 0; i < world.count(); ++i) {
    if (world.State(i).x_m > 0.02) continue;
    number[i] = static_cast<std::int32_t>(e.in.size());
    e.out.push_back(world.grains()[i].id);
    e.in.push_back(world.State(i));
  }
  ASSERT_GT(e.in.size(), 100u);
  const auto name = [&](std::int32_t place) {
    return number[place] >= 0 ? number[place] : -1 - world.grains()[place].id;
  };
  world.list().ForEachHistory([&](std::int32_t i, std::int32_t j, const float* words) {
    if (number[i] < 0 && number[j] < 0) return;
    GrainExchange::Touch t = {name(i), name(j), {}};
    std::copy_n(words, world.list().words(), t.words.begin());
    e.touches.push_back(t);
  });
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const float* words = number[i] >= 0 ? world.BodyHistory(i, 0, 0) : nullptr;
    if (!words) continue;
    GrainExchange::BodyTouch t = {number[i], 0, 0, {}};
    std::copy_n(words, world.list().words(), t.words.begin());
    e.body_touches.push_back(t);
  }
  const std::int64_t count = world.count();
  const std::int32_t first = world.Exchange(e);
  EXPECT_EQ(first, count);
  EXPECT_EQ(world.count(), count);
  EXPECT_THROW(world.StateOf(e.out[0]), std::exception);
  ASSERT_EQ(world.Run(100), StepFault::kNone);
  ASSERT_EQ(twin.Run(100), StepFault::kNone);
  double weight = 0;
  for (const Grain& g : twin.grains()) weight = std::max(weight, 9.81 * g.mass);
  double off = 0;
  for (std::int64_t i = 0; i < twin.count(); ++i) {
    const std::int32_t id = twin.grains()[i].id;
    const auto back = std::find(e.out.begin(), e.out.end(), id);
    const auto now =
        back == e.out.end() ? id : first + static_cast<std::int32_t>(back - e.out.begin());
    EXPECT_NEAR(world.StateOf(now).z_m, twin.StateOf(id).z_m, 2e-8);
    off = std::max(off, std::abs(static_cast<double>(world.LoadOf(now).fz - twin.LoadOf(id).fz)));
  }
  EXPECT_LT(off, 0.05 * weight);
  EXPECT_NEAR(world.Balance().Total(), twin.Balance().Total(), 1e-3 * twin.Balance().stored);
}

TEST(Exchange, PlacesLeftBehindBoundNoGrain) {
  World world(ChangeConfig(), Bed());
  Settled(world);
  GrainExchange away;  // so few that the same tiles stay
  for (std::int64_t i = 0; i < world.count() && away.out.size() < 5; ++i) {
    if (world.State(i).z_m > Highest(world) - 0.003) away.out.push_back(world.grains()[i].id);
  }
  ASSERT_EQ(away.out.size(), 5u);
  world.Exchange(away);
  const std::uint64_t before = world.phases().prunes;
  world.Run(300);
  EXPECT_LT(world.phases().prunes - before, 100u);
}

TEST(Exchange, NewGrainsFallAndOldOnesAreGone) {
  World world(ChangeConfig(), Bed());
  Settled(world);
  GrainExchange e;
  e.out = {0, 1, 2};
  GrainState drop = Bed()[5];
  drop.z_m = 0.04;
  e.in = {drop};
  const std::int64_t count = world.count();
  const std::int32_t id = world.Exchange(e);
  EXPECT_EQ(world.count(), count - 2);
  world.Run(500);  // 10 ms
  EXPECT_NEAR(world.StateOf(id).z_m, 0.04 - 0.5 * 9.81 * 1e-4, 1e-6);
  e.in.clear();
  EXPECT_THROW(world.Exchange(e), std::invalid_argument);  // they left already
  e.out = {id};
  e.touches = {{7, 8, {}}};
  EXPECT_THROW(world.Exchange(e), std::invalid_argument);
}

/// Sums go by gap, not by place: how grains were listed changes no bit.
TEST(Order, OfTheInputDoesNotMatter) {
  std::vector<GrainState> shuffled = Bed();
  std::vector<std::int32_t> from(shuffled.size());
  for (std::size_t i = 0; i < from.size(); ++i) from[i] = static_cast<std::int32_t>(i);
  std::shuffle(from.begin(), from.end(), std::mt19937(9));
  for (std::size_t i = 0; i < from.size(); ++i) shuffled[i] = Bed()[from[i]];
  World a(ChangeConfig(), Bed()), b(ChangeConfig(), shuffled);
  a.AddBody(Floor());
  b.AddBody(Floor());
  ASSERT_EQ(a.Run(1000), StepFault::kNone);
  ASSERT_EQ(b.Run(1000), StepFault::kNone);
  for (std::size_t i = 0; i < from.size(); ++i) {
    const GrainState p = a.StateOf(from[i]), q = b.StateOf(static_cast<std::int32_t>(i));
    EXPECT_EQ(p.z_m, q.z_m);
    EXPECT_EQ(p.w_x, q.w_x);
  }
}

/// Nor does a sort of memory on the way, histories included: the order of a bed
/// that was stirred changes, its motion does not.
void SortWithoutATrace(const WorldConfig& config, int materials) {
  std::vector<GrainState> stirred = Bed();
  for (std::size_t k = 0; k < stirred.size(); ++k) {
    GrainState& g = stirred[k];
    g.v_x = 0.4 * std::sin(600 * g.z_m);
    g.v_y = 0.2 * std::cos(300 * g.x_m);
    g.material = static_cast<int>(k) % materials;
  }
  World a(config, stirred), b(config, stirred);
  a.AddBody(Floor());
  b.AddBody(Floor());
  const auto order = [](const World& w) {
    std::vector<std::int32_t> ids;
    for (std::int64_t i = 0; i < w.count(); ++i) ids.push_back(w.grains()[i].id);
    return ids;
  };
  for (int k = 0; k < 10; ++k) {
    ASSERT_EQ(a.Run(700), StepFault::kNone);
    ASSERT_EQ(b.Run(700), StepFault::kNone);
    a.ImportState(a.ExportState());  // a search as well: partners are ordered then
    b.Sort();
  }
  EXPECT_NE(order(a), order(b));
  EXPECT_GT(a.MeanContacts(), 1);
  for (std::int32_t id = 0; id < static_cast<std::int32_t>(a.count()); ++id) {
    const GrainState p = a.StateOf(id), q = b.StateOf(id);
    ASSERT_EQ(p.x_m, q.x_m);
    ASSERT_EQ(p.v_z, q.v_z);
    ASSERT_EQ(p.w_y, q.w_y);
  }
  // Frozen soil keeps its order.
  b.Freeze(std::vector<std::uint8_t>(b.count(), 1));
  const auto before = order(b);
  b.Sort();
  EXPECT_EQ(order(b), before);
}
TEST(Order, ASortOnTheWayLeavesNoTrace) { SortWithoutATrace(ChangeConfig(), 1); }

/// Histories of several laws turn with the sides, each in its own words.
TEST(Order, ASortLeavesNoTraceInPairsWithTheirOwnLaws) {
  WorldConfig config = ChangeConfig();
  config.dt_s = 5e-6;  // own spin asks for a shorter one
  config.contacts = TwoMaterials(ThreeLaws());
  SortWithoutATrace(config, 2);
}

}  // namespace
}  // namespace grouser::dem
