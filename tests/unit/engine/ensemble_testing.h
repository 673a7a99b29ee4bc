#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "dem_offline/engine/gpu/ensemble.h"

// Small worlds for the tests of the ensemble.

namespace grouser::dem::gpu {

using Worlds = std::vector<std::unique_ptr<World>>;

inline WorldConfig Config(double dt_s = 1e-5) {
  WorldConfig c;
  c.frame = {0.030, 0.024, 1.0};
  c.gravity_m_per_s2 = {0, 0, 0};
  c.dt_s = dt_s;
  c.contacts = OneMaterial({1e7, 0.3}, {0.5, 0.5, 0.1});
  return c;
}

/// Grains that jostle between two glued layers that slide past each other.
inline std::vector<GrainState> Sheared(int seed, double speed = 0.1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<GrainState> grains;
  const int nx = 14, ny = 11, nz = 8;
  for (int k = 0; k < nx * ny * nz; ++k) {
    GrainState g = {};
    const int layer = k / (nx * ny);
    g.x_m = (k % nx + 0.5) * 0.030 / nx + 1e-4 * u(random);
    g.y_m = (k / nx % ny + 0.5) * 0.024 / ny + 1e-4 * u(random);
    g.z_m = 0.00197 * layer;
    g.radius_m = 0.00108 + 0.00004 * u(random);
    g.density_kg_per_m3 = 2600;
    g.glued = layer == 0 || layer == nz - 1;
    g.v_x = layer == 0 ? -speed : (layer == nz - 1 ? speed : 0.02 * u(random));
    if (!g.glued) g.v_y = 0.02 * u(random);
    grains.push_back(g);
  }
  return grains;
}

inline std::unique_ptr<World> Make(int seed, double dt_s = 1e-5) {
  return std::make_unique<World>(Config(dt_s), Sheared(seed));
}

inline Ensemble Together(const Worlds& worlds, Device& device, const ListSizes& sizes = {}) {
  std::vector<World*> all;
  for (const auto& w : worlds) all.push_back(w.get());
  return Ensemble(all, device, sizes);
}

inline void ExpectSame(const std::vector<Grain>& a, const std::vector<Grain>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(std::memcmp(&a[i], &b[i], sizeof(Grain)), 0) << "grain " << i;
  }
}

inline std::vector<Grain> Of(const World& w) {
  return {w.grains().begin(), w.grains().begin() + w.count()};
}

}  // namespace grouser::dem::gpu
