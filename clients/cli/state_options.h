#pragma once

#include <CLI/CLI.hpp>
#include <numbers>
#include <vector>

#include "grouser/v1alpha1/state.pb.h"

namespace grouser::cli {

inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;

/// Wheel states on the command line, in one of two forms: slip and attack
/// angle, or velocities. Lists have one length; a single value stands for all.
class StateOptions {
 public:
  void AddTo(CLI::App& command);

  /// The states in the form given. Throws CLI::ValidationError naming the
  /// option whose list does not fit.
  v1alpha1::WheelStates Build() const;

 private:
  std::vector<double> slip_, angle_deg_, speed_, v_x_, v_y_, rim_, load_;
};

}  // namespace grouser::cli
