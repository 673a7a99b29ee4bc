#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// n wheel states and room for their answers, structure of arrays, owned.
/// Answers start as NaN, flags as all bits: what was not written shows.
struct StateBatch {
  /// Room for every part and the echoes.
  explicit StateBatch(std::size_t n);
  /// Room for some parts of every output, without echoes: the other spans of Out are empty.
  StateBatch(std::size_t n, std::initializer_list<Part> parts);

  std::size_t size() const { return load.size(); }
  void Set(std::size_t i, double x, double y, double rim, double load_n) {
    v_x[i] = x;
    v_y[i] = y;
    rim_speed[i] = rim;
    load[i] = load_n;
  }
  void Set(std::size_t i, const VelocityState& v, double load_n) {
    Set(i, v.v_x, v.v_y, v.rim_speed, load_n);
  }

  /// Views of all states, or of `count` from `first` on.
  WheelStatesView In() const { return In(0, size()); }
  WheelStatesView In(std::size_t first, std::size_t count) const;
  ResponsesView Out() { return Out(0, size()); }
  ResponsesView Out(std::size_t first, std::size_t count);

  std::vector<double> v_x, v_y, rim_speed, load;
  std::vector<double> slope_pitch, slope_roll, yaw_rate;               ///< empty, or n entries
  std::vector<std::uint32_t> pass_number;                              ///< empty, or n entries
  std::array<std::array<std::vector<double>, kParts>, kOutputs> part;  ///< by Output and Part
  std::vector<std::uint32_t> flags;
  std::vector<double> slip, attack_angle;
};

}  // namespace grouser::surrogate
