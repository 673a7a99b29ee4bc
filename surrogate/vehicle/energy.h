#pragma once

#include <array>
#include <span>

#include "surrogate/vehicle/solver.h"

namespace grouser::vehicle {

/// Where the power of a solved motion goes [W]. With T w shaft power, F, M_z forces of the ground
/// in the wheel's axes, V the twist of the vehicle:
///   rolling = (T - r F_x) w     slip = F_x (r w - v_x)     scrub = -(F_y v_y + M_z yaw rate)
///   grade, acceleration: work against gravity and inertia; drive = electric - shaft
/// so that electric = drive + rolling + slip + scrub + grade + acceleration + imbalance, where
/// imbalance is what the solve left over times V.
struct Power {
  double electric = 0, shaft = 0;
  double drive = 0, rolling = 0, slip = 0, scrub = 0, grade = 0, acceleration = 0, imbalance = 0;
  std::array<double, kMostWheels> wheel{};  ///< shaft power by wheel
  double Sum() const { return drive + rolling + slip + scrub + grade + acceleration; }
};
/// Precondition: `solution` is of `motion`.
Power PowerOf(const Vehicle& vehicle, const Motion& motion, const Solution& solution) noexcept;

/// Power at the mean ground and at grounds better and worse by `sds` standard deviations.
struct PowerInterval {
  Power mean;
  double electric_low = 0, electric_high = 0;      ///< both NaN: no balance at one
  double joules_per_metre = 0, low = 0, high = 0;  ///< of way of the centre; NaN turning in place
  Solution solution;                               ///< at the mean
};
PowerInterval PowerOf(Solver* solver, const Motion& motion, double sds = 1.6448536269514722);

}  // namespace grouser::vehicle
