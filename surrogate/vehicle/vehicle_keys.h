#pragma once

#include <span>

#include "surrogate/models/hard_ground.h"
#include "surrogate/vehicle/vehicle.h"

namespace grouser::vehicle {

/// A number of the vehicle file: one table for the reader and for the schema.
template <class T>
struct NumberKey {
  const char* key;
  double T::*member;
  enum class Range { kAny, kPositive, kNonNegative } range;
  bool required;
  const char* what;
};

std::span<const NumberKey<Vehicle>> VehicleKeys();
std::span<const NumberKey<WheelType>> WheelTypeKeys();
std::span<const NumberKey<Wheel>> WheelKeys();
std::span<const NumberKey<Motor>> MotorKeys();
std::span<const NumberKey<Steering>> SteeringKeys();
std::span<const NumberKey<surrogate::HardGround>> HardKeys();

inline constexpr const char* kCouplingNames[] = {"locked", "differential", "independent"};

}  // namespace grouser::vehicle
