#pragma once

#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "clients/fmi/loader/fmu.h"
#include "grouser/contact.h"
#include "grouser/model.h"

// Wheels of FMUs by the loader, beside the model called directly.

namespace grouser::fmi::testing {

inline const std::filesystem::path kFmus = GROUSER_FMUS;

inline const Model& Shipped() {
  static const Model model = Model::Open(GROUSER_MODEL);
  return model;
}

/// A wheel that stands upright on level ground, heading `yaw` from x to y.
struct Pose {
  double yaw = 0, sinkage = 0.01, spin_angle = 0;
  double v_x = 0, v_y = 0, v_z = 0, spin = 0;  ///< in the wheel's directions [m/s], [rad/s]
  double ground = 0;
};

inline void SetPose(const Pose& p, Fmu* wheel) {
  const double c = std::cos(p.yaw), s = std::sin(p.yaw);
  const std::array<double, 3> pos = {1.5, -0.7, p.ground + Shipped().radius_m() - p.sinkage};
  const std::array<double, 3> velocity = {c * p.v_x - s * p.v_y, s * p.v_x + c * p.v_y, p.v_z};
  const std::array<double, 3> spin = {-s * p.spin, c * p.spin, 0};
  wheel->Set(wheel->References("wheel_state.pos"), pos);
  wheel->Set(wheel->References("wheel_state.lin_vel"), velocity);
  wheel->Set(wheel->References("wheel_state.ang_vel"), spin);
  // Yaw about z, then spin about the axle.
  const double cy = std::cos(p.yaw / 2), sy = std::sin(p.yaw / 2), cs = std::cos(p.spin_angle / 2),
               ss = std::sin(p.spin_angle / 2);
  const double rot[4] = {cy * cs, -sy * ss, cy * ss, sy * cs};
  for (int i = 0; i < 4; ++i) wheel->Set("wheel_state.rot.e" + std::to_string(i), rot[i]);
  wheel->Set("terrain_height", p.ground);
}

/// All outputs as Float64, to compare bits.
inline std::vector<double> OutputsOf(const Fmu& wheel) {
  std::vector<unsigned> references;
  for (const auto& [name, entry] : wheel.description().variables) {
    if (entry.causality == "output" && entry.type == "Float64") {
      references.push_back(entry.reference);
    }
  }
  std::vector<double> values(references.size());
  wheel.Get(references, values);
  return values;
}

}  // namespace grouser::fmi::testing
