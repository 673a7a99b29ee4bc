// Vehicles, paths, plans, constants; motions and their answers: motion_messages.cc.
#include "surrogate/vehicle/messages.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "surrogate/vehicle/message_checks.h"

namespace grouser::vehicle {
namespace {

v1alpha1::SpeedBinding ToMessage(Binding binding) {
  return static_cast<v1alpha1::SpeedBinding>(static_cast<int>(binding) + 1);
}
constexpr bool Same(v1alpha1::SpeedBinding wire, Binding ours) {
  return int{wire} == static_cast<int>(ours) + 1;
}
static_assert(Same(v1alpha1::SPEED_BINDING_SPEED_LIMIT, Binding::kSpeedLimit) &&
              Same(v1alpha1::SPEED_BINDING_TRACTION, Binding::kTraction) &&
              Same(v1alpha1::SPEED_BINDING_LATERAL_GRIP, Binding::kLateralGrip) &&
              Same(v1alpha1::SPEED_BINDING_TORQUE, Binding::kTorque) &&
              Same(v1alpha1::SPEED_BINDING_ROLLOVER, Binding::kRollover) &&
              Same(v1alpha1::SPEED_BINDING_SINKAGE, Binding::kSinkage) &&
              Same(v1alpha1::SPEED_BINDING_UNTRAINED_SPEED, Binding::kUntrainedSpeed) &&
              Same(v1alpha1::SPEED_BINDING_MODEL_DOMAIN, Binding::kModelDomain) &&
              Same(v1alpha1::SPEED_BINDING_ACCELERATION, Binding::kAcceleration) &&
              Same(v1alpha1::SPEED_BINDING_BRAKING, Binding::kBraking) &&
              Same(v1alpha1::SPEED_BINDING_INPUT, Binding::kInput) &&
              Same(v1alpha1::SpeedBinding_MAX, Binding::kInput));

// What a newer server may know and this program does not counts as input.
Binding FromMessage(int binding) {
  return binding >= 1 && binding <= int{v1alpha1::SpeedBinding_MAX}
             ? static_cast<Binding>(binding - 1)
             : Binding::kInput;
}

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

std::uint8_t SoilIndexOf(const std::string& field, const std::string& name,
                         const std::vector<std::string>& soils) {
  const auto found = std::find(soils.begin(), soils.end(), name);
  if (found != soils.end()) return static_cast<std::uint8_t>(found - soils.begin());
  std::string all;
  for (const std::string& soil : soils) all += (all.empty() ? "" : ", ") + soil;
  Refuse(field, "'" + name.substr(0, 64) + "'", "one of " + all);
}

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

std::vector<PathPoint> FromMessage(const v1alpha1::Path& from, const DescribedVehicle& vehicle) {
  const int n = from.s_m_size();
  if (n < 2) Refuse("path.s_m", std::to_string(n) + " entries", "2 or more");
  CheckSize("path.curvature_per_m", from.curvature_per_m_size(), n);
  CheckSize("path.grade_rad", from.grade_rad_size(), n);
  CheckSize("path.bank_rad", from.bank_rad_size(), n);
  CheckSize("path.soil", from.soil_size(), n);
  CheckFinite("path.s_m", from.s_m());
  CheckFinite("path.curvature_per_m", from.curvature_per_m());
  CheckFinite("path.grade_rad", from.grade_rad());
  CheckFinite("path.bank_rad", from.bank_rad());
  const SoilTable soils("path", from.soils(), vehicle.soils);
  std::vector<PathPoint> path(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    if (i > 0 && !(from.s_m(i) > from.s_m(i - 1))) {
      Refuse(EntryName("path.s_m", i), std::to_string(from.s_m(i)),
             "more than that before, " + std::to_string(from.s_m(i - 1)));
    }
    path[static_cast<std::size_t>(i)] = {
        from.s_m(i), EntryOr0(from.curvature_per_m(), i), EntryOr0(from.grade_rad(), i),
        EntryOr0(from.bank_rad(), i),
        from.soil().empty() ? soils.first() : soils.At("path.soil", i, from.soil(i))};
  }
  return path;
}

void ToMessage(std::span<const PathPoint> from, v1alpha1::Path* to) {
  for (const PathPoint& p : from) {
    to->add_s_m(p.s_m);
    to->add_curvature_per_m(p.curvature_per_m);
    to->add_grade_rad(p.grade_rad);
    to->add_bank_rad(p.bank_rad);
    to->add_soil(p.soil);
  }
}

void ToMessage(std::span<const SpeedPoint> from, v1alpha1::SpeedPlan* to) {
  for (const SpeedPoint& p : from) {
    to->add_safe_m_per_s(p.safe_m_per_s);
    to->add_safe_binding(ToMessage(p.safe_binding));
    to->add_speed_m_per_s(p.speed_m_per_s);
    to->add_acceleration_m_per_s2(p.acceleration_m_per_s2);
    to->add_binding(ToMessage(p.binding));
    to->add_shortfall(p.shortfall);
    to->add_holds(p.holds);
  }
}

void FromMessage(const v1alpha1::SpeedPlan& from, std::span<SpeedPoint> to) {
  const auto n = static_cast<int>(to.size());
  for (const int size : {from.safe_m_per_s_size(), from.safe_binding_size(),
                         from.speed_m_per_s_size(), from.acceleration_m_per_s2_size(),
                         from.binding_size(), from.shortfall_size(), from.holds_size()}) {
    if (size != n) Refuse("plan", std::to_string(size) + " entries", std::to_string(n));
  }
  for (int i = 0; i < n; ++i) {
    to[static_cast<std::size_t>(i)] = {from.safe_m_per_s(i),
                                       FromMessage(from.safe_binding(i)),
                                       from.speed_m_per_s(i),
                                       from.acceleration_m_per_s2(i),
                                       FromMessage(from.binding(i)),
                                       from.shortfall(i),
                                       from.holds(i)};
  }
}

void FromMessage(const v1alpha1::Margins& from, SpeedOptions* to) {
  if (from.has_tip()) to->tip_margin = from.tip();
  to->torque_margin = from.torque();
  to->sinkage_margin = from.sinkage();
  to->trained_only = !from.untrained();
  if (!(to->tip_margin >= 0 && to->tip_margin < 1)) {
    Refuse("margins.tip", std::to_string(to->tip_margin), "0 to below 1");
  }
  for (const auto& [name, value] :
       {std::pair("margins.torque", from.torque()), std::pair("margins.sinkage", from.sinkage())}) {
    if (!std::isfinite(value)) Refuse(name, std::to_string(value), "a finite number");
  }
}

void ToMessage(const SpeedOptions& from, v1alpha1::Margins* to) {
  to->set_tip(from.tip_margin);
  to->set_torque(from.torque_margin);
  to->set_sinkage(from.sinkage_margin);
  to->set_untrained(!from.trained_only);
}

void ToMessage(const std::string& soil, const GradeRange& from, v1alpha1::SoilGrades* to) {
  to->set_soil(soil);
  to->set_any(from.any);
  to->set_down_rad(from.down_rad);
  to->set_up_rad(from.up_rad);
  to->set_binding_down(ToMessage(from.binding_down));
  to->set_binding_up(ToMessage(from.binding_up));
}

GradeRange FromMessage(const v1alpha1::SoilGrades& from) {
  return {from.any(), from.down_rad(), from.up_rad(), FromMessage(from.binding_down()),
          FromMessage(from.binding_up())};
}

void ToMessage(const SkidConstants& from, v1alpha1::SkidConstants* to) {
  to->set_soil(from.soil);
  to->set_speed_m_per_s(from.speed_m_per_s);
  to->set_radius_m(from.radius_m);
  to->set_separation_multiplier(from.separation_multiplier);
  to->set_separation_low(from.separation_low);
  to->set_separation_high(from.separation_high);
  to->set_radius_multiplier(from.radius_multiplier);
  to->set_radius_low(from.radius_low);
  to->set_radius_high(from.radius_high);
  to->set_variance_speed(from.variance_speed);
  to->set_variance_yaw_rate(from.variance_yaw_rate);
  to->set_pull_over_weight(from.pull_over_weight);
  to->set_pull_low(from.pull_low);
  to->set_reasons(from.reasons);
}

SkidConstants FromMessage(const v1alpha1::SkidConstants& from) {
  return {from.soil(),
          from.speed_m_per_s(),
          from.radius_m(),
          from.separation_multiplier(),
          from.separation_low(),
          from.separation_high(),
          from.radius_multiplier(),
          from.radius_low(),
          from.radius_high(),
          from.variance_speed(),
          from.variance_yaw_rate(),
          from.pull_over_weight(),
          from.pull_low(),
          from.reasons()};
}

}  // namespace grouser::vehicle
