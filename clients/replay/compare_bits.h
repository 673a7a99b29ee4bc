#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "grouser/v1alpha1/state.pb.h"

namespace grouser::replay {

/// A number of an answer that has other bits now.
struct Difference {
  std::string field;  ///< "f_x.value"
  int state;          ///< index; -1: of the whole message
  std::string logged, now;
};

/// Whether two numbers have the same bits; any two NaN do.
bool SameBits(double a, double b);

/// Compares arrays of answers state by state. An array that one of the two lacks counts as NaN; see
/// Comparison::of_lcm.
struct Comparison {
  /// States to look at, an entry each.
  std::vector<bool> states;
  std::uint32_t ignored_flags = 0;
  bool whole_message = true;  ///< interval level and target, averaging length, too
  /// What LCM does not carry (velocity, slip.speed_m_per_s, sd_form and measured_* of outputs) is
  /// not compared where the logged answer lacks it.
  bool of_lcm = false;
};
/// Calls `tell` for each number that differs.
void CompareBits(const v1alpha1::WheelResponses& logged, const v1alpha1::WheelResponses& now,
                 const Comparison& comparison, const std::function<void(Difference)>& tell);

}  // namespace grouser::replay
