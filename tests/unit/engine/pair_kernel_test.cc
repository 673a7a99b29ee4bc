// The pair kernel and its lists against brute force, symmetry and bit equality.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "dem_offline/engine/laws/contact_model.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {
namespace {

WorldConfig Config() {
  WorldConfig c;
  c.frame = {0.1, 0.08, 1.0};
  c.gravity_m_per_s2 = {0, 0, 0};
  c.dt_s = 1e-5;
  c.contacts = OneMaterial({1e7, 0.3}, {0.5, 0.5, 0.1});
  return c;
}

bool Engulfed(const GrainState& a, const std::vector<GrainState>& others) {
  for (const GrainState& b : others) {
    const double dx = std::remainder(a.x_m - b.x_m, 0.1), dy = std::remainder(a.y_m - b.y_m, 0.08);
    const double reach = 0.7 * (a.radius_m + b.radius_m), dz = a.z_m - b.z_m;
    if (dx * dx + dy * dy + dz * dz < reach * reach) return true;
  }
  return false;
}

/// A periodic cloud of overlapping grains in motion.
std::vector<GrainState> Cloud(int n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(0, 1);
  std::vector<GrainState> out;
  while (static_cast<int>(out.size()) < n) {
    GrainState g = {};
    g.x_m = 0.1 * u(random);
    g.y_m = 0.08 * u(random);
    g.z_m = 0.0003 * n * u(random);
    g.radius_m = 0.003 + 0.002 * u(random);
    g.density_kg_per_m3 = 2500;
    g.v_x = u(random) - 0.5;
    g.v_y = u(random) - 0.5;
    g.v_z = u(random) - 0.5;
    g.w_x = 20 * (u(random) - 0.5);
    g.w_y = 20 * (u(random) - 0.5);
    g.w_z = 20 * (u(random) - 0.5);
    if (!Engulfed(g, out)) out.push_back(g);
  }
  return out;
}

/// Forces of all pairs by double loop, double geometry, the same law.
std::vector<Vec3f> BruteForce(const WorldConfig& c, const std::vector<GrainState>& grains) {
  std::vector<Vec3f> force(grains.size(), Vec3f{0, 0, 0});
  const auto params = HertzMindlinEpsd::From(c.contacts.Table()[0]);
  for (std::size_t i = 0; i < grains.size(); ++i) {
    for (std::size_t j = 0; j < grains.size(); ++j) {
      if (i == j) continue;
      const GrainState &a = grains[i], &b = grains[j];
      const double dx = std::remainder(a.x_m - b.x_m, c.frame.length_m);
      const double dy = std::remainder(a.y_m - b.y_m, c.frame.width_m), dz = a.z_m - b.z_m;
      const double dist = std::sqrt(dx * dx + dy * dy + dz * dz);
      const double overlap = a.radius_m + b.radius_m - dist;
      if (overlap <= 0) continue;
      ContactGeometry g = {};
      g.n = {float(dx / dist), float(dy / dist), float(dz / dist)};
      g.overlap = float(overlap);
      const float li = float(a.radius_m - overlap / 2), lj = float(b.radius_m - overlap / 2);
      const Vec3f wi = {float(a.w_x), float(a.w_y), float(a.w_z)};
      const Vec3f wj = {float(b.w_x), float(b.w_y), float(b.w_z)};
      g.v_rel = Vec3f{float(a.v_x - b.v_x), float(a.v_y - b.v_y), float(a.v_z - b.v_z)} -
                Cross(li * wi + lj * wj, g.n);
      g.w_rel = wi - wj;
      g.r_eff = float(a.radius_m * b.radius_m / (a.radius_m + b.radius_m));
      const auto mass = [](const GrainState& s) {
        return s.density_kg_per_m3 * 4 / 3 * M_PI * std::pow(s.radius_m, 3);
      };
      g.m_eff = float(mass(a) * mass(b) / (mass(a) + mass(b)));
      const double ia = 1.4 * mass(a) * a.radius_m * a.radius_m;
      const double ib = 1.4 * mass(b) * b.radius_m * b.radius_m;
      g.roll_inertia = float(ia * ib / (ia + ib));
      float words[HertzMindlinEpsd::kWords] = {};
      const ContactResult r = HertzMindlinEpsd::Evaluate(params, g, words, float(c.dt_s));
      force[i] = force[i] + r.force;
    }
  }
  return force;
}

TEST(PairKernel, AgreesWithBruteForce) {
  const auto grains = Cloud(300, 1);
  World world(Config(), grains);
  world.Start();
  const auto expected = BruteForce(Config(), grains);
  double scale = 0;
  for (const auto& f : expected) scale = std::max(scale, double(Sqrt(Dot(f, f))));
  for (std::int64_t i = 0; i < world.count(); ++i) {
    const Vec3f e = expected[world.grains()[i].id];
    const GrainLoad& got = world.loads()[i];
    EXPECT_NEAR(got.fx, e.x, 2e-5 * scale);
    EXPECT_NEAR(got.fy, e.y, 2e-5 * scale);
    EXPECT_NEAR(got.fz, e.z, 2e-5 * scale);
  }
}

TEST(PairKernel, MomentumIsConserved) {
  World world(Config(), Cloud(300, 2));
  for (int s = 0; s < 50; ++s) ASSERT_EQ(world.Step(), StepFault::kNone);
  double sum[3] = {}, size = 0;
  for (const GrainLoad& f : world.loads()) {
    sum[0] += f.fx;
    sum[1] += f.fy;
    sum[2] += f.fz;
    size += std::abs(f.fx) + std::abs(f.fy) + std::abs(f.fz);
  }
  for (const double s : sum) EXPECT_LT(std::abs(s), 1e-6 * size);
}

std::vector<Grain> RunWith(const char* isa, int recipe) {
  // The choice is made once a process, so the sets are driven directly.
  World world(Config(), Cloud(200, 3));
  world.Start();
  PairView v = {};
  std::vector<GrainLoad> loads(world.grains().size());
  v.grains = world.grains().data();
  v.loads = loads.data();
  v.tiles = static_cast<int>(world.grains().size() / kLanes);
  v.first_slot = world.list().first_slot().data();
  v.partner = world.list().partner().data();
  for (int w = 0; w < world.list().words(); ++w) v.history[w] = world.list().history()[w].data();
  v.row_touches = world.list().row_touches().data();
  const auto q = Config().frame.Quantum();
  std::copy(q.begin(), q.end(), v.quantum);
  const auto params = Config().contacts.Table();
  v.params = params.data();
  v.materials = Config().contacts.materials();
  v.laws = Config().contacts.laws();
  v.layout = Config().contacts.layout();
  v.dt = 1e-5f;
  PairKernelFn fn = PairKernelFor(isa, recipe, false);
  for (int s = 0; s < 5; ++s) fn(v, 0, v.tiles, nullptr);
  std::vector<Grain> out(world.grains());
  for (std::size_t i = 0; i < out.size(); ++i) std::memcpy(&out[i].x, &loads[i], sizeof(GrainLoad));
  return out;
}

TEST(PairKernel, IsBitwiseEqualOverInstructionSets) {
  const auto base = RunWith("baseline", 0);
  int compared = 0;
  for (const char* isa : {"avx2", "avx512"}) {
    if (!PairKernelFor(isa, 0, false)) continue;
    const auto other = RunWith(isa, 0);
    EXPECT_EQ(std::memcmp(base.data(), other.data(), base.size() * sizeof(Grain)), 0) << isa;
    ++compared;
  }
  if (compared == 0) GTEST_SKIP() << "this machine has the baseline set alone";
}

TEST(PairKernel, TheGenericPathIsBitwiseEqualToTheRecipe) {
  const auto recipe = RunWith("baseline", 0), generic = RunWith("baseline", -1);
  EXPECT_EQ(std::memcmp(recipe.data(), generic.data(), recipe.size() * sizeof(Grain)), 0);
}

TEST(PairKernel, ThreadsDoNotChangeABit) {
  WorldConfig one = Config(), three = Config();
  one.energy = three.energy = true;
  three.threads = 3;
  World a(one, Cloud(1500, 7)), b(three, Cloud(1500, 7));
  for (int s = 0; s < 100; ++s) {
    ASSERT_EQ(a.Step(), StepFault::kNone);
    ASSERT_EQ(b.Step(), StepFault::kNone);
  }
  EXPECT_EQ(a.Hash(), b.Hash());
  EXPECT_EQ(a.energy().slip, b.energy().slip);
}

TEST(PairKernel, RepeatsBitwise) {
  World a(Config(), Cloud(250, 4)), b(Config(), Cloud(250, 4));
  for (int s = 0; s < 200; ++s) {
    ASSERT_EQ(a.Step(), StepFault::kNone);
    ASSERT_EQ(b.Step(), StepFault::kNone);
  }
  EXPECT_GT(a.rebuilds(), 1u);
  EXPECT_EQ(std::memcmp(a.grains().data(), b.grains().data(), a.grains().size() * sizeof(Grain)), 0);
}

TEST(NeighbourList, HistorySurvivesARebuild) {
  World world(Config(), Cloud(300, 5));
  for (int s = 0; s < 20; ++s) world.Step();
  const auto count = [&] {
    double n = 0;
    for (const float a : world.list().history()[0]) n += a != 0.0f;
    return n;
  };
  const double before = count();
  ASSERT_GT(before, 100);
  world.list().Build(world.grains(), world.count(), Config().frame, 0.002f);
  EXPECT_EQ(count(), before);
}

TEST(NeighbourList, RegrowsWithoutLosingAnything) {
  WorldConfig small = Config();
  small.first_slots = kLanes;
  World a(Config(), Cloud(300, 8)), b(small, Cloud(300, 8));
  EXPECT_EQ(a.regrowths(), 0u);
  EXPECT_GT(b.regrowths(), 0u);
  for (int s = 0; s < 100; ++s) {
    a.Step();
    b.Step();
  }
  EXPECT_EQ(a.Hash(), b.Hash());
}

TEST(NeighbourList, RefusesABoxThatIsTooSmall) {
  WorldConfig c = Config();
  c.frame.length_m = 0.02;
  EXPECT_THROW(World(c, Cloud(10, 6)), std::invalid_argument);
}

}  // namespace
}  // namespace grouser::dem
