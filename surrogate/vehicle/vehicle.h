#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

/// A vehicle as plain numbers. Axes are those of ISO 8855: x forward, y to the left, z up; the
/// origin lies on the ground, where the vehicle's own drawing puts it. SI and radians.
namespace grouser::vehicle {

inline constexpr std::size_t kMostWheels = 8, kMostDrives = 8;
inline constexpr double kUnlimited = std::numeric_limits<double>::infinity();

struct WheelType {
  std::string name;
  double radius_m = 0, width_m = 0;
};

struct Wheel {
  std::string name;
  std::size_t type = 0;  ///< index of the wheel type
  double x_m = 0, y_m = 0;
  int drive = -1;  ///< index of the drive; -1: it rolls freely
  bool steered = false;
  double stiffness = 1;   ///< vertical, relative to the other wheels [-]
  double roll_share = 1;  ///< of the roll moment, relative to the other wheels [-]
  int bogie = -1;         ///< wheels of one bogie share their load equally; -1: none
};

/// How a drive turns its wheels.
enum class Coupling {
  kLocked,  ///< one motor, all rims at one speed (chain or belt: a side of a skid-steered robot)
  kDifferential,  ///< one motor, open differential: one torque at every wheel
  kIndependent    ///< a motor at each wheel, rims in proportion to what the steering asks for
};

/// A direct-current motor behind a gear, or what is known of it. With the torque T at the wheels
/// and their spin w (T w > 0: it drives):
///   motor torque tau = T/(gear efficiency) driving, T efficiency/gear braking
///   current i = tau/torque_constant + no_load_current sgn(w)
///   voltage = resistance i + torque_constant gear w,   electric power = voltage i
/// Without torque constant: electric power = T w/efficiency driving, T w efficiency braking.
struct Motor {
  double torque_constant_n_m_per_a = 0;  ///< 0: unknown
  double resistance_ohm = 0, no_load_current_a = 0;
  double gear = 1;                       ///< turns of the motor for one of the wheels
  double efficiency = 1;                 ///< of the gear, (0, 1]
  double torque_limit_n_m = kUnlimited;  ///< at the wheels
  double current_limit_a = kUnlimited, voltage_limit_v = kUnlimited;
  double power_limit_w = kUnlimited;  ///< electric
};

struct Drive {
  std::string name;
  Coupling coupling = Coupling::kLocked;
  Motor motor;  ///< of each wheel where kIndependent, else of all of them
};

/// One steering command psi for all steered wheels: wheel i points along
///   (cos psi - sin psi y_i/L, sin psi (x_i - centre_x)/L),
/// so that all axes meet at (centre_x, L/tan psi) (Ackermann). psi = 90 degrees turns in place.
struct Steering {
  double centre_x_m = 0;                  ///< of the axle that does not steer, or the middle
  double length_m = 1;                    ///< L > 0: tan(psi) = L times curvature
  double limit_rad = 1.5707963267948966;  ///< largest |psi|
};

struct Vehicle {
  std::string name;
  double mass_kg = 0;
  double centre_x_m = 0, centre_y_m = 0, centre_z_m = 0;  ///< of gravity
  double yaw_inertia_kg_m2 = 0;
  double gravity_m_per_s2 = 9.81;
  double sinkage_limit = 0.5;  ///< over the radius: deeper counts as stuck
  std::vector<WheelType> wheel_types;
  std::vector<Wheel> wheels;
  std::vector<Drive> drives;
  Steering steering;

  bool steered() const;
};

/// Throws std::invalid_argument "FIELD: got X, expected Y" for what no solve can use: no wheels,
/// wheels on one line, a mass that is not positive, a number that is not finite, a centre of
/// gravity outside the wheels, controls that do not determine the motion (one drive and steering,
/// or two drives).
void Check(const Vehicle& vehicle);

}  // namespace grouser::vehicle
