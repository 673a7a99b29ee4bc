#include "clients/in_process/grouser/vehicle.h"

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "clients/in_process/vehicle_parts.h"
#include "surrogate/vehicle/constants.h"
#include "surrogate/vehicle/yaml.h"

namespace grouser {
namespace {

// The public header repeats these; it may not include ours.
static_assert(std::uint32_t{kNoBalance} == vehicle::kNoBalance &&
              std::uint32_t{kOverTorque} == vehicle::kOverTorque &&
              std::uint32_t{kSinksIn} == vehicle::kSinksIn &&
              std::uint32_t{kTips} == vehicle::kTips &&
              std::uint32_t{kUntrainedSpeed} == vehicle::kUntrainedSpeed &&
              std::uint32_t{kModelDomain} == vehicle::kModelDomain &&
              std::uint32_t{kBadInput} == vehicle::kBadInput);
static_assert(kBalancedResidual == vehicle::Solution::kTolerance);
static_assert(kWorseBySd == vehicle::SpeedOptions{}.worse_by_sd);

template <class T>
std::vector<std::string> NamesOf(const std::vector<T>& parts) {
  std::vector<std::string> names;
  for (const T& part : parts) names.push_back(part.name);
  return names;
}

std::vector<WheelPlace> PlacesOf(const vehicle::Vehicle& v) {
  std::vector<WheelPlace> places;
  for (const vehicle::Wheel& w : v.wheels) {
    const bool own = w.drive >= 0 && v.drives[static_cast<std::size_t>(w.drive)].coupling ==
                                         vehicle::Coupling::kIndependent;
    places.push_back({w.x_m, w.y_m, v.wheel_types[w.type].radius_m, w.drive, w.steered, own});
  }
  return places;
}

}  // namespace

std::string NamesOfReasons(std::uint32_t reasons) { return vehicle::NamesOf(reasons); }

std::string Fault::Text() const {
  if (name == nullptr) return "";
  if (of_size) {
    return std::string(name) + ": " + std::to_string(got_entries) + " entries, expected " +
           std::to_string(entries) + expected;
  }
  const std::string at = index < 0 ? "" : "[" + std::to_string(index) + "]";
  return name + at + ": " + std::to_string(got) + ", expected " + expected;
}

Vehicle::Vehicle(std::shared_ptr<const Parts> parts) noexcept : parts_(std::move(parts)) {}
Vehicle::Vehicle(const Vehicle& other) noexcept = default;
Vehicle& Vehicle::operator=(const Vehicle& other) noexcept = default;
Vehicle::~Vehicle() = default;

Vehicle Vehicle::Open(const std::filesystem::path& vehicle_file) try {
  auto parts = std::make_shared<Parts>();
  parts->file = vehicle::ReadVehicle(vehicle_file.string());
  parts->wheels = NamesOf(parts->file.vehicle.wheels);
  parts->drives = NamesOf(parts->file.vehicle.drives);
  parts->places = PlacesOf(parts->file.vehicle);
  return Vehicle(std::move(parts));
} catch (const std::exception& error) {
  // Of a class that the caller can catch: those of the library are hidden.
  const std::string file = vehicle_file.string(), what = error.what();
  throw std::runtime_error(what.starts_with(file) ? what : file + ": " + what);
}

const std::string& Vehicle::name() const noexcept { return parts_->file.vehicle.name; }
double Vehicle::mass_kg() const noexcept { return parts_->file.vehicle.mass_kg; }
double Vehicle::gravity_m_per_s2() const noexcept { return parts_->file.vehicle.gravity_m_per_s2; }
std::size_t Vehicle::wheels() const noexcept { return parts_->wheels.size(); }
std::size_t Vehicle::drives() const noexcept { return parts_->drives.size(); }
bool Vehicle::steered() const noexcept { return parts_->file.vehicle.steered(); }
const std::vector<std::string>& Vehicle::wheel_names() const noexcept { return parts_->wheels; }
const std::vector<std::string>& Vehicle::drive_names() const noexcept { return parts_->drives; }
const std::vector<std::string>& Vehicle::soils() const noexcept {
  return parts_->file.grounds.soils;
}

const std::vector<WheelPlace>& Vehicle::wheel_places() const noexcept { return parts_->places; }
double Vehicle::steering_centre_m() const noexcept {
  return parts_->file.vehicle.steering.centre_x_m;
}
double Vehicle::steering_length_m() const noexcept {
  return parts_->file.vehicle.steering.length_m;
}

std::uint8_t Vehicle::soil(const std::string& name) const {
  const auto found = std::find(soils().begin(), soils().end(), name);
  if (found == soils().end()) {
    throw std::invalid_argument("soil: got " + name + ", expected one of the vehicle, such as " +
                                vehicle::yaml::NearestOf(name, soils()));
  }
  return static_cast<std::uint8_t>(found - soils().begin());
}

std::vector<SkidConstants> Vehicle::Constants(std::span<const double> speeds,
                                              std::span<const double> radii) const {
  if (speeds.empty()) throw std::invalid_argument("speeds: none, expected one or more");
  if (radii.empty()) throw std::invalid_argument("radii: none, expected one or more");
  std::vector<SkidConstants> out;
  for (const vehicle::SkidConstants& c :
       vehicle::ConstantsOf(parts_->file.vehicle, parts_->file.grounds, speeds, radii)) {
    out.push_back({c.soil, c.speed_m_per_s, c.radius_m, c.separation_multiplier, c.separation_low,
                   c.separation_high, c.radius_multiplier, c.radius_low, c.radius_high,
                   c.variance_speed, c.variance_yaw_rate, c.pull_over_weight, c.pull_low,
                   c.reasons});
  }
  return out;
}

}  // namespace grouser
