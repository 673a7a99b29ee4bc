// Paths, plans, grades, constants. Vehicles: vehicle_message.cc; motions and their answers:
// motion_messages.cc.
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

}  // namespace

std::uint8_t SoilIndexOf(const std::string& field, const std::string& name,
                         const std::vector<std::string>& soils) {
  const auto found = std::find(soils.begin(), soils.end(), name);
  if (found != soils.end()) return static_cast<std::uint8_t>(found - soils.begin());
  std::string all;
  for (const std::string& soil : soils) all += (all.empty() ? "" : ", ") + soil;
  Refuse(field, "'" + name.substr(0, 64) + "'", "one of " + all);
}

void CheckSizes(const v1alpha1::Path& from) {
  const int n = from.s_m_size();
  if (n < 2) Refuse("path.s_m", std::to_string(n) + " entries", "2 or more");
  CheckSize("path.curvature_per_m", from.curvature_per_m_size(), n);
  CheckSize("path.grade_rad", from.grade_rad_size(), n);
  CheckSize("path.bank_rad", from.bank_rad_size(), n);
  CheckSize("path.soil", from.soil_size(), n);
}

std::vector<PathPoint> FromMessage(const v1alpha1::Path& from, const DescribedVehicle& vehicle) {
  CheckSizes(from);
  const int n = from.s_m_size();
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

void ToMessage(const std::string& soil, const NamedWeights& from, v1alpha1::SoilMixture* to) {
  to->set_name(soil);
  for (const auto& [name, weight] : from) {
    to->add_of(name);
    to->add_weight(weight);
  }
}

NamedWeights FromMessage(const std::string& field, const v1alpha1::SoilMixture& from) {
  if (from.weight_size() != from.of_size()) {
    Refuse(field + ".weight", std::to_string(from.weight_size()) + " entries",
           std::to_string(from.of_size()));
  }
  NamedWeights weights;
  for (int i = 0; i < from.of_size(); ++i) weights.emplace_back(from.of(i), from.weight(i));
  return weights;
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
