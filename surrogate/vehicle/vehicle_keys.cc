#include "surrogate/vehicle/vehicle_keys.h"

#include <vector>

namespace grouser::vehicle {
namespace {

template <class T>
using Range = typename NumberKey<T>::Range;
using surrogate::HardGround;

constexpr NumberKey<Vehicle> kVehicle[] = {
    {"mass_kg", &Vehicle::mass_kg, Range<Vehicle>::kPositive, true, "with everything aboard"},
    {"yaw_inertia_kg_m2", &Vehicle::yaw_inertia_kg_m2, Range<Vehicle>::kPositive, true,
     "about the vertical through the centre of gravity"},
    {"gravity_m_per_s2", &Vehicle::gravity_m_per_s2, Range<Vehicle>::kPositive, false,
     "that of the models; 9.81 on hard ground alone"},
    {"sinkage_limit", &Vehicle::sinkage_limit, Range<Vehicle>::kPositive, false,
     "sinkage over wheel radius that counts as stuck (0.5)"},
};
constexpr NumberKey<WheelType> kWheelType[] = {
    {"radius_m", &WheelType::radius_m, Range<WheelType>::kPositive, true, "of the rim"},
    {"width_m", &WheelType::width_m, Range<WheelType>::kPositive, true, ""},
};
constexpr NumberKey<Wheel> kWheel[] = {
    {"stiffness", &Wheel::stiffness, Range<Wheel>::kPositive, false,
     "vertical, relative to the other wheels (1)"},
    {"roll_share", &Wheel::roll_share, Range<Wheel>::kPositive, false,
     "of the roll moment, relative to the other wheels (1)"},
};
constexpr NumberKey<Motor> kMotor[] = {
    {"torque_constant_n_m_per_a", &Motor::torque_constant_n_m_per_a, Range<Motor>::kPositive, false,
     "unknown: electric power is shaft power over efficiency"},
    {"resistance_ohm", &Motor::resistance_ohm, Range<Motor>::kNonNegative, false, ""},
    {"no_load_current_a", &Motor::no_load_current_a, Range<Motor>::kNonNegative, false, ""},
    {"gear", &Motor::gear, Range<Motor>::kPositive, false,
     "turns of the motor for one of the wheels (1)"},
    {"efficiency", &Motor::efficiency, Range<Motor>::kPositive, false,
     "of the gear, at most 1 (1)"},
    {"torque_limit_n_m", &Motor::torque_limit_n_m, Range<Motor>::kPositive, false,
     "at the wheels, of all that this motor turns"},
    {"current_limit_a", &Motor::current_limit_a, Range<Motor>::kPositive, false, ""},
    {"voltage_limit_v", &Motor::voltage_limit_v, Range<Motor>::kPositive, false, ""},
    {"power_limit_w", &Motor::power_limit_w, Range<Motor>::kPositive, false, "electric"},
};
constexpr NumberKey<Steering> kSteering[] = {
    {"centre_x_m", &Steering::centre_x_m, Range<Steering>::kAny, true,
     "of the axle that does not steer, or of the middle"},
    {"length_m", &Steering::length_m, Range<Steering>::kPositive, true,
     "L: tan(steering angle) = L times curvature"},
    {"limit_rad", &Steering::limit_rad, Range<Steering>::kPositive, false,
     "largest steering angle (pi/2)"},
};

}  // namespace

std::span<const NumberKey<Vehicle>> VehicleKeys() { return kVehicle; }
std::span<const NumberKey<WheelType>> WheelTypeKeys() { return kWheelType; }
std::span<const NumberKey<Wheel>> WheelKeys() { return kWheel; }
std::span<const NumberKey<Motor>> MotorKeys() { return kMotor; }
std::span<const NumberKey<Steering>> SteeringKeys() { return kSteering; }
std::span<const NumberKey<HardGround>> HardKeys() {
  static const std::vector<NumberKey<HardGround>> keys = [] {
    std::vector<NumberKey<HardGround>> of_fields;
    for (const surrogate::HardGroundField& f : surrogate::HardGroundFields()) {
      const auto range =
          f.zero_allowed ? Range<HardGround>::kNonNegative : Range<HardGround>::kPositive;
      of_fields.push_back({f.name, f.member, range, f.required, f.what});
    }
    return of_fields;
  }();
  return keys;
}

}  // namespace grouser::vehicle
