// Single contacts against exact answers and the published benchmarks of Chung &
// Ooi (Granular Matter 13 (2011) 643), tests 1, 2, 4.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "dem_offline/engine/laws/material.h"
#include "dem_offline/engine/world/world.h"

namespace grouser::dem {
namespace {

WorldConfig Box(double size_m, double dt_s) {
  WorldConfig c;
  c.frame = {size_m, size_m, 4 * size_m};
  c.gravity_m_per_s2 = 0;
  c.dt_s = dt_s;
  return c;
}

struct Impact {
  double peak_overlap_m = 0, peak_force_n = 0, contact_s = 0;
  GrainState after;
};

/// Steps until grain `id` has touched something and parted again.
Impact Follow(World& world, double dt_s) {
  Impact out;
  bool touched = false;
  for (int s = 0; s < 2000000; ++s) {
    EXPECT_EQ(world.Step(), StepFault::kNone);
    int at = 0;
    while (world.grains()[at].id != 0) ++at;
    const GrainLoad& f = world.loads()[at];
    if (f.touching > 0) {
      touched = true;
      out.contact_s += dt_s;
      out.peak_force_n = std::max(out.peak_force_n, std::abs(static_cast<double>(f.fz)));
      const auto overlaps = world.OverlapRatios();
      if (!overlaps.empty()) {
        out.peak_overlap_m =
            std::max(out.peak_overlap_m, static_cast<double>(overlaps[0]) * world.grains()[at].radius);
      }
    } else if (touched) {
      out.after = world.State(at);
      return out;
    }
  }
  ADD_FAILURE() << "the grains never parted";
  return out;
}

TEST(SingleContacts, TwoElasticGlassSpheres) {  // Chung & Ooi 1
  const double r = 0.01, dt = 2e-8;
  WorldConfig c = Box(0.2, dt);
  c.grain_grain = MakeParams({48e9, 0.2}, {48e9, 0.2}, {1.0, 0.35, 0});
  World world(c, {{0.1, 0.1, r + 1e-6, r, 2800, 0, 0, -10}, {0.1, 0.1, -r - 1e-6, r, 2800, 0, 0, 10}});
  const Impact hit = Follow(world, dt);
  EXPECT_NEAR(hit.peak_overlap_m, 274e-6, 0.005 * 274e-6);
  EXPECT_NEAR(hit.peak_force_n, 10.70e3, 0.005 * 10.70e3);
  EXPECT_NEAR(hit.contact_s, 40.35e-6, 0.005 * 40.35e-6);
  EXPECT_NEAR(hit.after.v_z, 10, 0.01);
}

TEST(SingleContacts, ElasticAluminiumSphereOnRigidWall) {  // Chung & Ooi 2
  const double r = 0.1, dt = 2e-7;
  WorldConfig c = Box(2, dt);
  c.grain_floor = MakeWallParams({70e9, 0.3}, {1.0, 0.0, 0});
  c.grain_grain = MakeParams({70e9, 0.3}, {70e9, 0.3}, {1.0, 0.0, 0});
  c.floor_z_m = 0;
  World world(c, {{1, 1, r + 1e-6, r, 2699, 0, 0, -0.2}});
  const Impact hit = Follow(world, dt);
  EXPECT_NEAR(hit.peak_force_n, 11.37e3, 0.005 * 11.37e3);
  EXPECT_NEAR(hit.contact_s, 732e-6, 0.005 * 732e-6);
  EXPECT_NEAR(hit.after.v_z, 0.2, 2e-4);
}

TEST(SingleContacts, RestitutionDoesNotDependOnSpeed) {
  for (const double e : {0.3, 0.5, 0.9}) {
    for (const double speed : {0.01, 0.1, 1.0}) {
      const double r = 0.005, dt = 2e-7;
      WorldConfig c = Box(0.1, dt);
      c.grain_grain = MakeParams({1e8, 0.3}, {1e8, 0.3}, {e, 0.5, 0});
      World world(c, {{0.05, 0.05, r + 1e-7, r, 2500, 0, 0, -speed},
                      {0.05, 0.05, -r - 1e-7, r, 2500, 0, 0, speed}});
      EXPECT_NEAR(Follow(world, dt).after.v_z / speed, e, 0.01) << "e " << e << " at " << speed;
    }
  }
}

// Chung & Ooi 4: above 32.5 degrees the whole impact slides, and the spin is
// 2.5 mu (1 + e) v_n / r.
TEST(SingleContacts, SlidingObliqueImpactSpins) {
  const double r = 0.0025, dt = 2e-9, mu = 0.092, e = 0.98, v = 3.9;
  for (const double degrees : {40.0, 60.0, 80.0}) {
    const double a = degrees * M_PI / 180;
    WorldConfig c = Box(0.05, dt);
    c.grain_grain = MakeParams({380e9, 0.23}, {380e9, 0.23}, {e, mu, 0});
    c.grain_floor = MakeWallParams({380e9, 0.23}, {e, mu, 0});
    c.floor_z_m = 0;
    World world(c, {{0.025, 0.025, r + 1e-8, r, 4000, v * std::sin(a), 0, -v * std::cos(a)}});
    const Impact hit = Follow(world, dt);
    const double spin = 2.5 * mu * (1 + e) * v * std::cos(a) / r;
    EXPECT_NEAR(hit.after.w_y, spin, 0.002 * spin) << degrees;
    const double lost = mu * (1 + e) * v * std::cos(a);
    EXPECT_NEAR(hit.after.v_x, v * std::sin(a) - lost, 0.005 * v) << degrees;
  }
}

// Partly sticking impacts of the same test, 2.5 % of the incident tangential
// speed. At 5 and 10 degrees the dissipative, rescaled law differs from the
// published curve by more (0.857 and 0.713 against 0.948 and 0.687), which was
// made with F = k_t(a) xi, a law that makes energy; see docs/engine.md.
TEST(SingleContacts, StickingObliqueImpactRebounds) {
  const double r = 0.0025, dt = 2e-9, v = 3.9;
  const struct { double degrees, restitution; } rows[] = {{15, 0.624}, {20, 0.616}, {25, 0.634}, {30, 0.684}};
  for (const auto& row : rows) {
    const double a = row.degrees * M_PI / 180;
    WorldConfig c = Box(0.05, dt);
    c.grain_grain = MakeParams({380e9, 0.23}, {380e9, 0.23}, {0.98, 0.092, 0});
    c.grain_floor = MakeWallParams({380e9, 0.23}, {0.98, 0.092, 0});
    c.floor_z_m = 0;
    World world(c, {{0.025, 0.025, r + 1e-8, r, 4000, v * std::sin(a), 0, -v * std::cos(a)}});
    const Impact hit = Follow(world, dt);
    EXPECT_NEAR(hit.after.v_x / (v * std::sin(a)), row.restitution, 0.025) << row.degrees;
  }
}

// A sliding sphere starts to roll at t = 2/7 u0/(mu g) with 5/7 u0.
TEST(SingleContacts, SlipBecomesRolling) {
  const double r = 0.0005, dt = 2e-6, g = 9.81, u0 = 0.1;
  for (const double mu : {0.2, 0.6, 1.0}) {
    WorldConfig c = Box(0.1, dt);
    c.gravity_m_per_s2 = g;
    c.grain_grain = MakeParams({1e7, 0.3}, {1e7, 0.3}, {0.5, mu, 0});
    c.grain_floor = MakeWallParams({1e7, 0.3}, {0.5, mu, 0});
    c.floor_z_m = 0;
    const double sag = std::pow(1e4 * 4 / 3.0 * M_PI * r * r * r * g /
                                    (4 / 3.0 * 1e7 / 0.91 * std::sqrt(r)), 2 / 3.0);
    World world(c, {{0.05, 0.05, r - sag, r, 1e4, u0, 0, 0}});
    double rolls_at = 0;
    for (int s = 0; s < 1000000 && rolls_at == 0; ++s) {
      world.Step();
      const GrainState b = world.State(0);
      if (b.v_x - b.w_y * r < 1e-3 * u0) rolls_at = (s + 1) * dt;
    }
    EXPECT_NEAR(rolls_at * mu * g / u0, 2.0 / 7.0, 0.006 * 2 / 7) << mu;
    EXPECT_NEAR(world.State(0).v_x / u0, 5.0 / 7.0, 0.006 * 5 / 7) << mu;
  }
}

TEST(SingleContacts, EpsdHoldsASpinningGrainBack) {
  const double r = 0.005, dt = 1e-6;
  WorldConfig c = Box(0.1, dt);
  c.gravity_m_per_s2 = 9.81;
  c.grain_grain = MakeParams({1e7, 0.3}, {1e7, 0.3}, {0.5, 0.5, 0.1});
  c.grain_floor = MakeWallParams({1e7, 0.3}, {0.5, 0.5, 0.1});
  c.floor_z_m = 0;
  World world(c, {{0.05, 0.05, r - 1e-6, r, 2500, 0.05, 0, 0, 0, 0.05 / r, 0}});
  for (int s = 0; s < 400000; ++s) world.Step();
  EXPECT_NEAR(world.State(0).v_x, 0, 1e-6);  // static, not creeping
  EXPECT_NEAR(world.State(0).w_y, 0, 1e-3);
}

TEST(Materials, RefuseNonsense) {
  EXPECT_THROW(MakeWallParams({0, 0.3}, {}), std::invalid_argument);
  EXPECT_THROW(MakeWallParams({1e7, 0.7}, {}), std::invalid_argument);
  EXPECT_THROW(MakeWallParams({1e7, 0.3}, {0.0, 0.5, 0.1}), std::invalid_argument);
  EXPECT_THROW(MakeWallParams({1e7, 0.3}, {0.5, -1, 0.1}), std::invalid_argument);
}

}  // namespace
}  // namespace grouser::dem
