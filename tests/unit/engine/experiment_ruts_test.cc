// Ruts behind a wheel with treads, on surfaces of known wavelength.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "dem_offline/engine/experiment/ruts.h"
#include "tests/unit/engine/experiment_testing.h"

namespace grouser::dem::experiment {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A slope, waves of a length and of an amplitude whose lowest places scatter, and a roughness.
Trace Waves(double length, double amplitude, double scatter, double rough, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> g(0, 1);
  Trace t;
  t.from_m = 0.3;
  t.step_m = 0.002;
  std::vector<double> bottom;
  for (int k = -1; k < 40; ++k) bottom.push_back((k + 0.5) * length + scatter * g(random));
  for (int i = 0; i < 600; ++i) {
    const double x = i * t.step_m;
    std::size_t k = 0;
    while (bottom[k + 1] <= x) ++k;
    const double phase = (x - bottom[k]) / (bottom[k + 1] - bottom[k]);
    t.height_m.push_back(0.1 + 0.05 * x - amplitude * std::cos(2 * M_PI * phase) +
                         rough * g(random));
  }
  return t;
}

TEST(Ruts, WavesHaveTheirLengthAndDepth) {
  for (const double length : {0.05, 0.0623, 0.08}) {
    const Ruts r = FindRuts(Waves(length, 0.004, 0, 0), 0.07);
    EXPECT_NEAR(r.spacing_m, length, 2e-4) << length;
    EXPECT_NEAR(r.mean_depth_m, 0.008, 3e-4);
    EXPECT_LT(r.spacing_error_m, 1e-4);
    EXPECT_NEAR(static_cast<double>(r.bottoms.size()), 1.2 / length, 1.01);
  }
}

/// Over many rough traces the mean is without bias, and the error is what it scatters by.
TEST(Ruts, TheStandardErrorIsTheScatterOfTheMean) {
  double sum = 0, squares = 0, errors = 0;
  constexpr int kTraces = 200;
  for (unsigned seed = 0; seed < kTraces; ++seed) {
    const Ruts r = FindRuts(Waves(0.06, 0.004, 0.003, 0.0004, seed), 0.07);
    ASSERT_TRUE(std::isfinite(r.spacing_m)) << seed;
    sum += r.spacing_m / kTraces;
    squares += r.spacing_m * r.spacing_m / kTraces;
    errors += r.spacing_error_m / kTraces;
  }
  const double scatter = std::sqrt(squares - sum * sum);
  EXPECT_NEAR(sum, 0.06, 3 * scatter / std::sqrt(1.0 * kTraces));
  EXPECT_NEAR(errors / scatter, 1, 0.15);
}

TEST(Ruts, GapsAndARutThatIsMissingDoNotShiftTheMean) {
  Trace t = Waves(0.06, 0.004, 0, 0);
  for (std::size_t k = 100; k < 110; ++k) t.height_m[k] = kNan;
  for (std::size_t k = 285; k < 330; ++k) t.height_m[k] = 0.14;  // filled up again
  const Ruts r = FindRuts(t, 0.07);
  EXPECT_NEAR(r.spacing_m, 0.06, 3e-4);
}

TEST(Ruts, NoneWhereThereAreNone) {
  const Trace waves = Waves(0.06, 0.004, 0, 0);
  EXPECT_TRUE(FindRuts(waves, 0.02).bottoms.empty());  // not between half and 1.5 times
  EXPECT_TRUE(FindRuts(waves, 0.2).bottoms.empty());
  Trace shorter = waves;
  shorter.height_m.resize(60);  // 0.12 m
  EXPECT_TRUE(FindRuts(shorter, 0.07).bottoms.empty());
  EXPECT_TRUE(std::isnan(FindRuts(shorter, 0.07).spacing_m));
  EXPECT_TRUE(FindRuts(Trace{0, 0.002, {}}, 0.07).bottoms.empty());
}

/// A wheel goes over waves of grains, which hang without gravity, and does not touch them.
constexpr double kLength = 0.055, kRadius = 0.001;
Experiment OverWaves() {
  Experiment e = Empty();
  e.gravity_m_per_s2 = 0;
  e.box.length_m = 1.2;
  e.grains[0].listed.clear();
  for (double x = kRadius; x < 1.2 - kRadius; x += 2.05 * kRadius) {
    e.grains[0].listed.push_back(
        {x, 0.5, 0.05 + 0.005 * std::cos(2 * M_PI * x / kLength), kRadius, 2500});
  }
  MotionStep move;
  move.verb = "move";
  move.velocity_m_per_s = {2, 0, 0};
  move.for_s = 0.45;
  BodySpec b = Ball({move});
  b.name = "wheel";
  PartSpec p;
  p.shape = PartShape::kWheel;
  p.radius_m = 0.05;
  p.width_m = 0.02;
  Tread t;
  t.count = 6;
  t.height_m = 0.01;
  t.root_thickness_m = t.tip_thickness_m = 0.004;
  p.treads = {t};
  b.parts = {p};
  b.position_m = {0.1, 0.5, 0.2};
  e.bodies = {b};
  Probe probe;
  probe.kind = Probe::Kind::kRuts;
  probe.name = "ruts";
  probe.body = "wheel";
  probe.n[0] = 1200;
  probe.from_s = 0.05;
  e.probes = {probe};
  e.sample_s = 0.05;
  return e;
}

TEST(Ruts, AProbeFollowsTheWheel) {
  Experiment e = OverWaves();
  e.checkpoint_every_s = 0.2;
  Recorded rec, rest;
  std::string saved;
  RunExtras extras;
  extras.checkpoint = [&](const std::string& bytes) {
    if (saved.empty()) saved = bytes;
  };
  const Result result = RunExperiment(e, rec.Sink(), nullptr, {}, extras);
  ASSERT_TRUE(result.done) << result.reason;
  EXPECT_TRUE(std::isnan(rec.Column("ruts.spacing_m").front()));  // no trace yet
  EXPECT_NEAR(rec.Column("ruts.spacing_m").back(), kLength, 5e-4);
  EXPECT_LT(rec.Column("ruts.spacing_error_m").back(), 5e-4);
  EXPECT_NEAR(rec.Column("ruts.depth_m").back(), 0.0105, 7e-4);
  const auto x = rec.Column("x_m", "ruts"), depth = rec.Column("depth_m", "ruts"),
             height = rec.Column("height_m", "ruts");
  EXPECT_NEAR(x.front(), 0.2, 2e-3);  // where the wheel is after 0.05 s
  EXPECT_NEAR(x.back(), 1.0 - 0.8 * 0.06, 2e-3);
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (std::isnan(depth[k])) continue;
    EXPECT_NEAR(std::remainder(x[k] - 0.5 * kLength, kLength), 0, 0.007);
    EXPECT_NEAR(height[k], 0.0455, 7e-4);  // on a cap, or between two
  }
  // From a checkpoint the trace begins where it began.
  extras.resume = saved;
  extras.checkpoint = nullptr;
  ASSERT_TRUE(RunExperiment(e, rest.Sink(), nullptr, {}, extras).done);
  EXPECT_EQ(rest.Column("x_m", "ruts"), x);
}

TEST(Ruts, WhatCannotBeIsRefusedByName) {
  const auto refusal = [](const Experiment& e) -> std::string {
    try {
      PlanOf(e);
    } catch (const SpecError& error) {
      return error.field() + ": " + error.got();
    }
    return "accepted";
  };
  EXPECT_EQ(refusal(OverWaves()), "accepted");
  Experiment e = OverWaves();
  e.probes[0].n[0] = 100;  // 12 mm of 63
  EXPECT_EQ(refusal(e), "probes[0].n: [100, 1, 1]");
  e = OverWaves();
  e.bodies[0].parts[0].treads.clear();
  EXPECT_EQ(refusal(e), "probes[0].body: 'wheel', which has no treads");
  e = OverWaves();
  e.probes[0].body = "cart";
  EXPECT_EQ(refusal(e), "probes[0].body: 'cart'");
}

}  // namespace
}  // namespace grouser::dem::experiment
