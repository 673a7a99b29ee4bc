#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "surrogate/vehicle/messages.h"

namespace grouser::cli {

/// One motion as the command line says it.
struct MotionOptions {
  std::string soil;
  std::vector<std::string> soils;
  std::optional<double> speed, yaw_rate, curvature, radius;
  std::vector<double> rim;
  double steer_deg = 0, grade_deg = 0, bank_deg = 0, acceleration = 0;

  void AddTo(CLI::App* app);
  /// Throws CLI::ParseError for what makes no sense together, or a soil that is none.
  vehicle::Motion MotionOf(const vehicle::DescribedVehicle& described) const;
};

/// Throws CLI::ParseError with the nearest name there is.
std::uint8_t SoilOption(const vehicle::DescribedVehicle& described, const std::string& name);

}  // namespace grouser::cli
