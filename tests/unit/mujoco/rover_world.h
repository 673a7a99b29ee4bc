#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "grouser/mujoco.h"

namespace grouser::mujoco {

inline const std::string kSand = GROUSER_SOURCE "/surrogate/pairs/cmu-smooth-62.5-8mm/hybrid.model";

/// A model of text or of a file, deleted at its end.
struct Scene {
  mjModel* m;

  explicit Scene(const std::string& file = GROUSER_MUJOCO "/rover.xml") {
    char error[500] = "";
    m = mj_loadXML(file.c_str(), nullptr, error, sizeof error);
    if (m == nullptr) throw std::runtime_error(error);
    m->opt.enableflags |= mjENBL_ENERGY;
  }
  ~Scene() { mj_deleteModel(m); }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
};

/// The rover with some texts of its file replaced, each by the other.
inline std::string Changed(const std::vector<std::pair<std::string, std::string>>& texts) {
  std::stringstream text;
  text << std::ifstream(GROUSER_MUJOCO "/rover.xml").rdbuf();
  std::string all = text.str();
  for (const auto& [from, to] : texts) {
    const std::size_t at = all.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    if (at != std::string::npos) all.replace(at, from.size(), to);
  }
  const std::string file = ::testing::TempDir() + "/grouser_changed_rover.xml";
  std::ofstream(file) << all;
  return file;
}
inline std::string Changed(const std::string& from, const std::string& to) {
  return Changed({{from, to}});
}

struct World {
  const mjModel* m;
  mjData* d;

  explicit World(const mjModel* model) : m(model), d(mj_makeData(model)) {}
  ~World() { mj_deleteData(d); }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// Spins asked of the wheels: left, right, left, right [m/s at the rim].
  void Drive(double left, double right) {
    for (int i = 0; i < 4; ++i) d->ctrl[i] = (i % 2 == 0 ? left : right) / 0.0625;
  }
  /// Drive() from a start of rolling: each side's hubs move at its rim speed. From rest, wheels
  /// that are driven at once slip by almost 1, where the model of a loose sand may have no pull: a
  /// second equilibrium, in which the wheels spin on the spot.
  void Roll(double left, double right) {
    Drive(left, right);
    constexpr double kTrack = 0.4;  // of rover.xml [m]
    d->qvel[0] = 0.5 * (left + right);
    d->qvel[5] = (right - left) / kTrack;
    for (int i = 0; i < 4; ++i) d->qvel[6 + i] = d->ctrl[i];
  }
  /// Stands for a second, goes ahead, turns, goes back in a curve, stands from 14 s on.
  void DriveAround() {
    const double t = d->time;
    if (t < 1 || t >= 14) {
      Drive(0, 0);
    } else if (t < 6) {
      Drive(0.09, 0.09);
    } else if (t < 10) {
      Drive(-0.06, 0.06);
    } else {
      Drive(-0.09, -0.05);
    }
  }
  /// Energy now: kinetic and potential [J].
  double Energy() {
    mj_forward(m, d);
    return d->energy[0] + d->energy[1];
  }
  double speed() const { return std::hypot(d->qvel[0], d->qvel[1]); }
  void Step(SoilContact* soil) {
    mj_step1(m, d);
    soil->Apply(m, d);
    mj_step2(m, d);
  }
};

}  // namespace grouser::mujoco
