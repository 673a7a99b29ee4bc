#pragma once

#include <array>
#include <cstddef>

#include "surrogate/vehicle/energy.h"
#include "surrogate/vehicle/solver.h"

namespace grouser::vehicle {

/// The numbers of an answer by name, in one order for everybody who takes answers apart (spans of
/// the in-process header, arrays of messages).
template <class T>
struct NumberField {
  const char* name;
  double T::*member;
};

inline constexpr std::array<NumberField<Solution>, 15> kSolutionFields = {
    {{"residual", &Solution::residual},
     {"v_x", &Solution::v_x_m_per_s},
     {"v_y", &Solution::v_y_m_per_s},
     {"yaw_rate", &Solution::yaw_rate_rad_per_s},
     {"side_slip", &Solution::side_slip_rad},
     {"steering", &Solution::steering_rad},
     {"pitching_moment", &Solution::pitching_moment_n_m},
     {"f_x", &Solution::f_x_n},
     {"f_y", &Solution::f_y_n},
     {"m_z", &Solution::m_z_n_m},
     {"shaft_power", &Solution::shaft_power_w},
     {"electric_power", &Solution::electric_power_w},
     {"tip_margin", &Solution::tip_margin},
     {"torque_margin", &Solution::torque_margin},
     {"sinkage_margin", &Solution::sinkage_margin}}};

inline constexpr std::array<NumberField<WheelSolution>, 13> kWheelFields = {
    {{"load", &WheelSolution::load_n},
     {"rim_speed", &WheelSolution::rim_speed_m_per_s},
     {"v_x", &WheelSolution::v_x_m_per_s},
     {"v_y", &WheelSolution::v_y_m_per_s},
     {"slip", &WheelSolution::slip},
     {"slip_angle", &WheelSolution::slip_angle_rad},
     {"steer", &WheelSolution::steer_rad},
     {"f_x", &WheelSolution::f_x_n},
     {"f_y", &WheelSolution::f_y_n},
     {"torque", &WheelSolution::torque_n_m},
     {"m_z", &WheelSolution::m_z_n_m},
     {"sinkage", &WheelSolution::sinkage_m},
     {"shaft_power", &WheelSolution::shaft_power_w}}};

/// Of a Power; of the interval about it.
inline constexpr std::array<NumberField<Power>, 9> kPowerFields = {
    {{"electric", &Power::electric},
     {"shaft", &Power::shaft},
     {"drive", &Power::drive},
     {"rolling", &Power::rolling},
     {"slip", &Power::slip},
     {"scrub", &Power::scrub},
     {"grade", &Power::grade},
     {"acceleration", &Power::acceleration},
     {"imbalance", &Power::imbalance}}};
inline constexpr std::array<NumberField<PowerInterval>, 5> kIntervalFields = {
    {{"electric_low", &PowerInterval::electric_low},
     {"electric_high", &PowerInterval::electric_high},
     {"joules_per_metre", &PowerInterval::joules_per_metre},
     {"joules_per_metre_low", &PowerInterval::low},
     {"joules_per_metre_high", &PowerInterval::high}}};

/// The numbers of a motion that are 0 unless given.
inline constexpr std::array<NumberField<Motion>, 5> kMotionFields = {
    {{"acceleration", &Motion::acceleration_m_per_s2},
     {"yaw_acceleration", &Motion::yaw_acceleration_rad_per_s2},
     {"grade", &Motion::grade_rad},
     {"bank", &Motion::bank_rad},
     {"worse_by_sd", &Motion::worse_by_sd}}};

}  // namespace grouser::vehicle
