#include <stdexcept>

#include "surrogate/vehicle/messages.h"

namespace grouser::vehicle {
namespace {

struct Limit {
  double Motor::*ours;
  bool (v1alpha1::Motor::*has)() const;
  double (v1alpha1::Motor::*get)() const;
  void (v1alpha1::Motor::*set)(double);
};
using WireMotor = v1alpha1::Motor;
constexpr Limit kMotorLimits[] = {{&Motor::torque_limit_n_m, &WireMotor::has_torque_limit_n_m,
                                   &WireMotor::torque_limit_n_m, &WireMotor::set_torque_limit_n_m},
                                  {&Motor::current_limit_a, &WireMotor::has_current_limit_a,
                                   &WireMotor::current_limit_a, &WireMotor::set_current_limit_a},
                                  {&Motor::voltage_limit_v, &WireMotor::has_voltage_limit_v,
                                   &WireMotor::voltage_limit_v, &WireMotor::set_voltage_limit_v},
                                  {&Motor::power_limit_w, &WireMotor::has_power_limit_w,
                                   &WireMotor::power_limit_w, &WireMotor::set_power_limit_w}};

void DriveToMessage(const Drive& from, v1alpha1::VehicleDrive* to) {
  to->set_name(from.name);
  to->set_coupling(static_cast<v1alpha1::DriveCoupling>(static_cast<int>(from.coupling) + 1));
  const Motor& m = from.motor;
  v1alpha1::Motor* motor = to->mutable_motor();
  motor->set_torque_constant_n_m_per_a(m.torque_constant_n_m_per_a);
  motor->set_resistance_ohm(m.resistance_ohm);
  motor->set_no_load_current_a(m.no_load_current_a);
  motor->set_gear(m.gear);
  motor->set_efficiency(m.efficiency);
  for (const Limit& limit : kMotorLimits) {
    if (m.*limit.ours != kUnlimited) (motor->*limit.set)(m.*limit.ours);
  }
}

Drive DriveFromMessage(const v1alpha1::VehicleDrive& from) {
  Drive to;
  to.name = from.name();
  if (from.coupling() < 1 || from.coupling() > 3) {
    throw std::invalid_argument("drives.coupling: " + std::to_string(from.coupling()) +
                                ", expected one of DriveCoupling");
  }
  to.coupling = static_cast<Coupling>(from.coupling() - 1);
  const v1alpha1::Motor& m = from.motor();
  to.motor.torque_constant_n_m_per_a = m.torque_constant_n_m_per_a();
  to.motor.resistance_ohm = m.resistance_ohm();
  to.motor.no_load_current_a = m.no_load_current_a();
  to.motor.gear = m.gear();
  to.motor.efficiency = m.efficiency();
  for (const Limit& limit : kMotorLimits) {
    if ((m.*limit.has)()) to.motor.*limit.ours = (m.*limit.get)();
  }
  return to;
}

void WheelToMessage(const Wheel& from, v1alpha1::VehicleWheel* to) {
  to->set_name(from.name);
  to->set_type(static_cast<std::uint32_t>(from.type));
  to->set_x_m(from.x_m);
  to->set_y_m(from.y_m);
  if (from.drive >= 0) to->set_drive(static_cast<std::uint32_t>(from.drive));
  to->set_steered(from.steered);
  to->set_stiffness(from.stiffness);
  to->set_roll_share(from.roll_share);
  if (from.bogie >= 0) to->set_bogie(static_cast<std::uint32_t>(from.bogie));
}

}  // namespace

void ToMessage(const DescribedVehicle& from, v1alpha1::Vehicle* to) {
  const Vehicle& v = from.vehicle;
  to->set_name(v.name);
  to->set_mass_kg(v.mass_kg);
  to->set_centre_x_m(v.centre_x_m);
  to->set_centre_y_m(v.centre_y_m);
  to->set_centre_z_m(v.centre_z_m);
  to->set_yaw_inertia_kg_m2(v.yaw_inertia_kg_m2);
  to->set_gravity_m_per_s2(v.gravity_m_per_s2);
  to->set_sinkage_limit(v.sinkage_limit);
  for (const WheelType& type : v.wheel_types) {
    v1alpha1::VehicleWheelType* t = to->add_wheel_types();
    t->set_name(type.name);
    t->set_radius_m(type.radius_m);
    t->set_width_m(type.width_m);
  }
  for (const Wheel& wheel : v.wheels) WheelToMessage(wheel, to->add_wheels());
  for (const Drive& drive : v.drives) DriveToMessage(drive, to->add_drives());
  to->mutable_steering()->set_centre_x_m(v.steering.centre_x_m);
  to->mutable_steering()->set_length_m(v.steering.length_m);
  to->mutable_steering()->set_limit_rad(v.steering.limit_rad);
  *to->mutable_soils() = {from.soils.begin(), from.soils.end()};
  *to->mutable_sources() = {from.sources.begin(), from.sources.end()};
}

DescribedVehicle FromMessage(const v1alpha1::Vehicle& from) {
  DescribedVehicle to;
  Vehicle& v = to.vehicle;
  v.name = from.name();
  v.mass_kg = from.mass_kg();
  v.centre_x_m = from.centre_x_m();
  v.centre_y_m = from.centre_y_m();
  v.centre_z_m = from.centre_z_m();
  v.yaw_inertia_kg_m2 = from.yaw_inertia_kg_m2();
  v.gravity_m_per_s2 = from.gravity_m_per_s2();
  v.sinkage_limit = from.sinkage_limit();
  for (const auto& t : from.wheel_types()) {
    v.wheel_types.push_back({t.name(), t.radius_m(), t.width_m()});
  }
  for (const auto& w : from.wheels()) {
    v.wheels.push_back({w.name(), w.type(), w.x_m(), w.y_m(),
                        w.has_drive() ? static_cast<int>(w.drive()) : -1, w.steered(),
                        w.stiffness(), w.roll_share(),
                        w.has_bogie() ? static_cast<int>(w.bogie()) : -1});
  }
  for (const auto& d : from.drives()) v.drives.push_back(DriveFromMessage(d));
  v.steering = {from.steering().centre_x_m(), from.steering().length_m(),
                from.steering().limit_rad()};
  to.soils = {from.soils().begin(), from.soils().end()};
  to.sources = {from.sources().begin(), from.sources().end()};
  Check(v);
  return to;
}

}  // namespace grouser::vehicle
