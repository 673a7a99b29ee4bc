// The timings: what they count and say. Nothing here fails on time.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <set>
#include <stdexcept>

#include "dem_offline/engine/bench/wheel.h"
#include "dem_offline/engine/bench/workload.h"

namespace grouser::dem::bench {
namespace {

BenchOptions Small() {
  BenchOptions o;
  o.particles = 2000;
  o.steps = 50;
  o.warmup = 10;
  o.repeat = 2;
  // Made once for all tests of this process.
  const std::string name = "grouser_bench_test_" + std::to_string(getpid()) + ".csv";
  o.bed = (std::filesystem::temp_directory_path() / name).string();
  return o;
}

class BenchTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::filesystem::remove(Small().bed);
    OpenBed(Small());
  }
  static void TearDownTestSuite() { std::filesystem::remove(Small().bed); }
};

void ExpectSamePhysics(const Physics& a, const Physics& b) {
  EXPECT_NEAR(a.mean_overlap_over_radius, b.mean_overlap_over_radius,
              1e-4 * a.mean_overlap_over_radius);
  EXPECT_NEAR(a.coordination, b.coordination, 1e-3 * a.coordination);
  EXPECT_NEAR(a.stress_zz_pa, b.stress_zz_pa, 1e-3 * a.stress_zz_pa);
}

TEST_F(BenchTest, BedIsSettledAndAsDeepAsItsOverlaps) {
  const Bed bed = OpenBed(Small());
  ASSERT_EQ(bed.grains.size(), 2000u);
  double solid = 0, weight = 0, least = 1, most = 0;
  for (const GrainState& g : bed.grains) {
    EXPECT_GE(g.z_m, 0.98 * g.radius_m);
    least = std::min(least, g.radius_m);
    most = std::max(most, g.radius_m);
    solid += 4 * M_PI / 3 * std::pow(g.radius_m, 3);
    weight += g.mass_kg * bed.source.gravity_m_per_s2;
  }
  EXPECT_NEAR(least / 0.001, 0.8, 0.01);
  EXPECT_NEAR(most / 0.001, 1.2, 0.01);
  const double fraction = solid / StressVolume(bed);
  EXPECT_GT(fraction, 0.55);
  EXPECT_LT(fraction, 0.66);
  // Half the weight of a bed rests on its middle.
  BenchOptions o = Small();
  o.repeat = 1;
  const Physics p = RunBench(o).physics;
  const double mean = 0.5 * weight / (bed.length_m * bed.width_m);
  EXPECT_NEAR(p.stress_zz_pa, mean, 0.1 * mean);
  EXPECT_GT(p.coordination, 4.5);
  EXPECT_LT(p.coordination, 6.2);
}

TEST_F(BenchTest, FileKeepsEveryBitOfABed) {
  const Bed bed = OpenBed(Small());
  const std::string path = Small().bed + ".copy";
  SaveBed(bed, path);
  const Bed again = LoadBed(path);
  std::filesystem::remove(path);
  ASSERT_EQ(again.grains.size(), bed.grains.size());
  EXPECT_EQ(again.kind, "bed");
  EXPECT_EQ(again.dt_s, bed.dt_s);
  EXPECT_EQ(again.source.friction, bed.source.friction);
  for (std::size_t i = 0; i < bed.grains.size(); ++i) {
    ASSERT_EQ(again.grains[i].x_m, bed.grains[i].x_m);
    ASSERT_EQ(again.grains[i].radius_m, bed.grains[i].radius_m);
    ASSERT_EQ(again.grains[i].mass_kg, bed.grains[i].mass_kg);
  }
}

TEST_F(BenchTest, ShuffledGrainsAreTheSameBed) {
  BenchOptions o = Small();
  const Bed sorted = OpenBed(o);
  const BenchResult a = RunBench(o);
  o.order = "shuffled";
  const Bed shuffled = OpenBed(o);
  const BenchResult b = RunBench(o);
  std::multiset<double> left, right;
  int moved = 0;
  for (std::size_t i = 0; i < sorted.grains.size(); ++i) {
    left.insert(sorted.grains[i].x_m);
    right.insert(shuffled.grains[i].x_m);
    moved += sorted.grains[i].x_m != shuffled.grains[i].x_m;
  }
  EXPECT_EQ(left, right);
  EXPECT_GT(moved, 1900);
  ExpectSamePhysics(a.physics, b.physics);
}

TEST_F(BenchTest, ThreadsAndWorldsDoTheSameWork) {
  BenchOptions o = Small();
  o.repeat = 1;
  const BenchResult one = RunBench(o);
  o.cores = 2;
  const BenchResult threads = RunBench(o);
  EXPECT_EQ(threads.threads_per_world, 2);
  EXPECT_EQ(threads.physics.stress_zz_pa, one.physics.stress_zz_pa);
  o.worlds = 3;
  const BenchResult worlds = RunBench(o);
  EXPECT_EQ(worlds.threads_per_world, 1);
  EXPECT_EQ(worlds.physics.stress_zz_pa, one.physics.stress_zz_pa);
  EXPECT_NEAR(worlds.Rate() * worlds.wall_s[0], 3 * 2000.0 * 50, 1e-6 * 3 * 2000 * 50);
}

TEST_F(BenchTest, JsonHasItsKeysAndTheyAgree) {
  const BenchResult r = RunBench(Small());
  const std::string json = ToJson(r);
  for (const char* key : {"workload", "particles", "worlds", "cores", "device", "isa", "order",
                          "particle_steps_per_s", "contacts_per_particle", "rebuilds", "phases",
                          "bytes_per_particle_step", "share_of_copy_rate"}) {
    EXPECT_NE(json.find("\"" + std::string(key) + "\": "), std::string::npos) << key;
  }
  EXPECT_EQ(json.front(), '{');
  EXPECT_EQ(json.back(), '}');
  EXPECT_EQ(r.rates.size(), 2u);
  EXPECT_GT(r.bytes_per_particle_step, 50);
  EXPECT_LT(r.bytes_per_particle_step, 5000);
  EXPECT_GT(r.copy_bytes_per_s, 1e8);
  EXPECT_NEAR(r.ShareOfCopyRate() * r.copy_bytes_per_s, r.bytes_per_particle_step * r.Rate(),
              1e-6 * r.bytes_per_particle_step * r.Rate());
  // Contacts with the floor come on top of those among grains.
  EXPECT_GE(r.contacts_per_particle, r.physics.coordination - 0.01);
  double phases = 0;
  for (const BenchPhase& p : r.phases) phases += p.seconds;
  EXPECT_GT(phases, 0);
  EXPECT_LE(phases, 1.01 * r.wall_s.back());
}

TEST_F(BenchTest, WhatItCannotDoIsRefusedByName) {
  const auto message = [](BenchOptions o) {
    try {
      CheckOptions(o);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message(Small()), "");
  BenchOptions o = Small();
  o.device = "cuda";
  o.workload = "wheel";
  EXPECT_NE(message(o).find("device: cuda, expected cpu for a wheel"), std::string::npos);
  o = Small();
  o.device = "tpu";
  EXPECT_NE(message(o).find("device"), std::string::npos);
  o = Small();
  o.order = "random";
  EXPECT_NE(message(o).find("order"), std::string::npos);
  o = Small();
  o.particles = 10;
  EXPECT_NE(message(o).find("particles"), std::string::npos);
  o = Small();
  o.workload = "wheel";
  o.cores = 2;
  EXPECT_NE(message(o).find("cores"), std::string::npos);
  // A file of another bed is not taken for this one.
  o = Small();
  o.particles = 3000;
  EXPECT_THROW(OpenBed(o), std::invalid_argument);
}

TEST(PrismWheel, IsAClosedMeshAboutTheWheelsRadius) {
  const WheelShape shape = WheelBench{}.wheel;
  for (const int sides : {24, 48}) {
    const Mesh mesh(PrismWheel(shape, sides));
    EXPECT_TRUE(mesh.closed());
    const double corner = 2 * shape.radius_m / (1 + std::cos(M_PI / sides));
    const double side = corner * std::cos(M_PI / sides);
    EXPECT_NEAR(corner - shape.radius_m, shape.radius_m - side, 1e-12);
    SurfacePoint at[kMostSurfacePoints];
    const auto distance = [&](double angle) {  // from 1 mm outside of the radius
      const double r = shape.radius_m + 1e-3;
      const Vec3f p = {static_cast<float>(r * std::sin(angle)), 0.003f,
                       static_cast<float>(r * std::cos(angle))};
      EXPECT_EQ(mesh.Nearest(p, 5e-3f, at, kMostSurfacePoints), 1);
      return at[0].distance;
    };
    EXPECT_NEAR(distance(0), shape.radius_m + 1e-3 - corner, 1e-7);
    EXPECT_NEAR(distance(M_PI / sides), shape.radius_m + 1e-3 - side, 1e-7);
    EXPECT_NEAR(distance(2 * M_PI / sides), shape.radius_m + 1e-3 - corner, 1e-7);
  }
  EXPECT_THROW(PrismWheel(shape, 2), std::invalid_argument);
}

/// Samples of 1 ms: a force that jitters about a mean.
Series Jitter(double seconds, double noise) {
  Series s;
  for (int k = 1; k <= static_cast<int>(seconds * 1000); ++k) {
    const double t = 1e-3 * k, wave = noise * std::sin(2 * M_PI * t / 0.037);
    s.time_s.push_back(t);
    s.f_x_n.push_back(-3 + wave);
    s.f_y_n.push_back(wave);
    s.f_z_n.push_back(24 + wave);
    s.torque_n_m.push_back(0.3);
    s.sinkage_m.push_back(0.01);
    s.travel_m.push_back(0.1 * t);
  }
  return s;
}

TEST(WheelJudge, StopsASeriesAtTheFirstLookThatSuffices) {
  const WheelBench bench;
  const WheelVerdict v = Judge(Jitter(1.9, 0.5), bench);
  EXPECT_TRUE(v.stopped);
  EXPECT_GE(v.travel_m, v.contact_length_m);
  EXPECT_LT(v.time_s, 1.9);
  EXPECT_NEAR(v.f_x_n.mean, -3, 0.05);
  EXPECT_LE(v.f_x_n.standard_error, 0.02 * bench.load_n);
  // A contact length of rim path, and no sooner: 0.0355 m at 0.1 m/s in the window.
  EXPECT_GT(v.time_s, bench.settle_s + v.contact_length_m / 0.1);
}

TEST(WheelJudge, DoesNotStopANoisyOrDriftingSeries) {
  Series noisy = Jitter(1.9, 0);
  for (std::size_t k = 0; k < noisy.time_s.size(); ++k) {
    noisy.f_x_n[k] += 8 * std::sin(2 * M_PI * noisy.time_s[k] / 0.3);
  }
  EXPECT_FALSE(Judge(noisy, WheelBench{}).stopped);
  Series drifting = Jitter(1.9, 0.1);
  for (std::size_t k = 0; k < drifting.time_s.size(); ++k) {
    drifting.sinkage_m[k] = 0.02 * drifting.time_s[k];
  }
  const WheelVerdict v = Judge(drifting, WheelBench{});
  EXPECT_FALSE(v.stopped);
  EXPECT_EQ(v.drifting, "sinkage");
}

}  // namespace
}  // namespace grouser::dem::bench
