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

PairView ViewOf(World& world, PairList& list, const std::vector<PairParams>& params) {
  PairView v = {};
  v.grains = world.grains().data();
  list.Fill(v);
  const auto q = Config().frame.Quantum();
  std::copy(q.begin(), q.end(), v.quantum);
  v.params = params.data();
  v.materials = Config().contacts.materials();
  v.layout = Config().contacts.layout();
  v.dt = 1e-5f;
  return v;
}

template <class T>
bool SameBits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

/// Loads after five sweeps, and grains after a drift by them.
struct Outcome {
  std::vector<GrainLoad> loads;
  std::vector<Grain> grains;
  std::vector<Kinetics> kinetics;
  bool operator==(const Outcome& o) const {
    return SameBits(loads, o.loads) && SameBits(grains, o.grains) && SameBits(kinetics, o.kinetics);
  }
};

Outcome RunWith(const char* isa, int combination) {
  // The choice is made once a process, so the sets are driven directly.
  World world(Config(), Cloud(200, 3));
  world.Start();
  PairList list = world.list();
  const auto params = Config().contacts.Table();
  const PairView v = ViewOf(world, list, params);
  const Kernels kernels = KernelsFor(isa, combination, false);
  Outcome out;
  out.grains = world.grains();
  out.loads.resize(out.grains.size());
  const auto tiles = static_cast<std::int64_t>(out.grains.size()) / kLanes;
  for (int s = 0; s < 5; ++s) {
    kernels.pairs(v, 0, list.blocks(), nullptr);
    kernels.sum(v, nullptr, out.loads.data(), 0, tiles);
  }
  DriftView d = {};
  d.grains = out.grains.data();
  d.loads = out.loads.data();
  out.kinetics.resize(out.grains.size());
  for (std::size_t i = 0; i < out.grains.size(); ++i) {
    out.kinetics[i].inverse_mass = 1 / out.grains[i].mass;
    out.kinetics[i].inverse_inertia = 1e8f;
  }
  const std::vector<DisplacementBound> bounds(out.grains.size(), DisplacementBound{0, 0, 0, 1.0f});
  d.kinetics = out.kinetics.data();
  d.bounds = bounds.data();
  for (int a = 0; a < 3; ++a) {
    d.quantum[a] = v.quantum[a];
    d.per_quantum[a] = 1e-5f / v.quantum[a];
    d.gravity_dt[a] = 1e-6f;
  }
  d.dt = 1e-5f;
  d.drag = 0.999f;
  DriftFound found;
  for (int s = 0; s < 5; ++s) kernels.drift(d, 0, tiles, &found);
  EXPECT_TRUE(found.finite && found.slow);
  return out;
}

TEST(PairKernel, IsBitwiseEqualOverInstructionSets) {
  const auto base = RunWith("baseline", 0);
  int compared = 0;
  for (const char* isa : {"avx2", "avx512"}) {
    if (!KernelsFor(isa, 0, false).pairs) continue;
    EXPECT_TRUE(RunWith(isa, 0) == base) << isa;
    ++compared;
  }
  if (compared == 0) GTEST_SKIP() << "this machine has the baseline set alone";
}

TEST(PairKernel, TheGenericPathIsBitwiseEqualToTheCombination) {
  EXPECT_TRUE(RunWith("baseline", 0) == RunWith("baseline", -1));
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

/// The pair as its second grain sees it is the same contact, signs turned: what
/// lets a pair be kept once and change its order.
TEST(PairList, AHistorySetFromTheOtherSideIsTurned) {
  World world(Config(), Cloud(300, 5));
  for (int s = 0; s < 20; ++s) world.Step();
  const int words = world.list().words();
  std::int32_t i = -1, j = -1;
  std::vector<float> seen(words);
  world.list().ForEachHistory([&](std::int32_t a, std::int32_t b, const float* w) {
    if (i >= 0 || w[1] == 0) return;
    i = a;
    j = b;
    seen.assign(w, w + words);
  });
  ASSERT_GE(i, 0);
  ASSERT_TRUE(world.list().SetHistory(j, i, seen.data()));
  world.list().ForEachHistory([&](std::int32_t a, std::int32_t b, const float* w) {
    if (a != i || b != j) return;
    EXPECT_EQ(w[0], seen[0]);  // stiffness: a size
    for (int k = 1; k < words; ++k) EXPECT_EQ(w[k], -seen[k]) << k;
  });
}

TEST(PairKernel, RepeatsBitwise) {
  World a(Config(), Cloud(250, 4)), b(Config(), Cloud(250, 4));
  for (int s = 0; s < 200; ++s) {
    ASSERT_EQ(a.Step(), StepFault::kNone);
    ASSERT_EQ(b.Step(), StepFault::kNone);
  }
  EXPECT_GT(a.rebuilds(), 1u);
  EXPECT_EQ(std::memcmp(a.grains().data(), b.grains().data(), a.grains().size() * sizeof(Grain)),
            0);
}

TEST(PairList, HistorySurvivesARebuild) {
  World world(Config(), Cloud(300, 5));
  for (int s = 0; s < 20; ++s) world.Step();
  const auto count = [&] {
    double sum = 0;
    world.list().ForEachHistory(
        [&](std::int32_t, std::int32_t, const float* w) { sum += w[0] + std::abs(w[1]); });
    return sum;
  };
  const double before = count();
  ASSERT_GT(before, 100);
  world.list().Build(world.grains(), world.count(), Config().frame, 0.002f);
  EXPECT_EQ(count(), before);
  std::vector<float> reaches;
  for (const Grain& g : world.grains()) reaches.push_back(g.radius + 1e-4f);
  world.list().Prune(world.grains(), reaches, Config().frame, 0.0f);
  EXPECT_EQ(count(), before);
}

TEST(PairList, RegrowsWithoutLosingAnything) {
  WorldConfig small = Config();
  small.first_pairs = kLanes;
  World a(Config(), Cloud(300, 8)), b(small, Cloud(300, 8));
  EXPECT_EQ(a.regrowths(), 0u);
  EXPECT_GT(b.regrowths(), 0u);
  for (int s = 0; s < 100; ++s) {
    a.Step();
    b.Step();
  }
  EXPECT_EQ(a.Hash(), b.Hash());
}

TEST(PairList, RefusesABoxThatIsTooSmall) {
  WorldConfig c = Config();
  c.frame.length_m = 0.02;
  EXPECT_THROW(World(c, Cloud(10, 6)), std::invalid_argument);
}

}  // namespace
}  // namespace grouser::dem
