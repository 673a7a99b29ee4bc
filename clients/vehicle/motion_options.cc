#include "clients/vehicle/motion_options.h"

#include <algorithm>
#include <numbers>

#include "surrogate/vehicle/yaml.h"

namespace grouser::cli {

using namespace vehicle;

namespace {
constexpr double kDegree = std::numbers::pi / 180;
}  // namespace

std::uint8_t SoilOption(const DescribedVehicle& described, const std::string& name) {
  const auto& soils = described.soils;
  for (std::size_t s = 0; s < soils.size(); ++s) {
    if (soils[s] == name) return static_cast<std::uint8_t>(s);
  }
  throw CLI::ValidationError("--soil", "got " + name + ", expected one of the vehicle, such as " +
                                           yaml::NearestOf(name, soils));
}

Motion MotionOptions::MotionOf(const DescribedVehicle& described) const {
  Motion m;
  const int turns =
      int(yaw_rate.has_value()) + int(curvature.has_value()) + int(radius.has_value());
  if (turns > 1) {
    throw CLI::ValidationError("--radius", "at most one of --yaw-rate, --curvature and --radius");
  }
  if (!rim.empty()) {
    if (speed || turns > 0) throw CLI::ValidationError("--rim", "not with a twist");
    if (rim.size() != described.vehicle.drives.size()) {
      throw CLI::ValidationError(
          "--rim", "got " + std::to_string(rim.size()) + " speeds, expected one a drive");
    }
    m.given = Motion::Given::kControls;
    std::copy(rim.begin(), rim.end(), m.rim_speed_m_per_s.begin());
    m.steering_rad = steer_deg * kDegree;
  } else {
    if (!speed && !yaw_rate) throw CLI::RequiredError("--speed, --yaw-rate or --rim");
    m.v_x_m_per_s = speed.value_or(0);
    if (radius && *radius == 0) {
      throw CLI::ValidationError("--radius",
                                 "got 0, expected another number (--yaw-rate turns in "
                                 "place)");
    }
    const double bend = radius ? 1 / *radius : curvature.value_or(0);
    m.yaw_rate_rad_per_s = yaw_rate.value_or(m.v_x_m_per_s * bend);
  }
  m.acceleration_m_per_s2 = acceleration;
  m.grade_rad = grade_deg * kDegree;
  m.bank_rad = bank_deg * kDegree;
  if (!soil.empty() && !soils.empty()) {
    throw CLI::ValidationError("--soil", "not with --soils");
  }
  if (!soil.empty()) m.soil.fill(SoilOption(described, soil));
  if (!soils.empty() && soils.size() != described.vehicle.wheels.size()) {
    throw CLI::ValidationError("--soils",
                               "got " + std::to_string(soils.size()) + ", expected one a wheel");
  }
  for (std::size_t i = 0; i < soils.size(); ++i) m.soil[i] = SoilOption(described, soils[i]);
  return m;
}

void MotionOptions::AddTo(CLI::App* app) {
  app->add_option("--speed", speed, "Forward speed of the origin [m/s]");
  app->add_option("--yaw-rate", yaw_rate, "To the left [rad/s]");
  app->add_option("--curvature", curvature, "Of the path, to the left [1/m]");
  app->add_option("--radius", radius, "Of the path, to the left [m]");
  app->add_option("--rim", rim, "Instead: rim speed of each drive [m/s]");
  app->add_option("--steer-deg", steer_deg, "With --rim: steering angle");
  app->add_option("--acceleration", acceleration, "Forward [m/s^2]");
  app->add_option("--grade-deg", grade_deg, "The ground rises ahead");
  app->add_option("--bank-deg", bank_deg, "The ground rises to the left");
  app->add_option(
      "--soil", soil,
      "Soil of all wheels, by name or as {NAME: WEIGHT, ...}; default: the vehicle's first");
  app->add_option("--soils", soils, "Soil of each wheel");
}

}  // namespace grouser::cli
