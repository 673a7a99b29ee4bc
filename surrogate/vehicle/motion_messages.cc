#include <limits>

#include "surrogate/vehicle/fields.h"
#include "surrogate/vehicle/message_checks.h"
#include "surrogate/vehicle/messages.h"

namespace grouser::vehicle {
namespace {

/// An array of a message, to read and to write.
template <class Message>
struct Array {
  const char* name;
  const Numbers& (Message::*get)() const;
  Numbers* (Message::*edit)();
};

// In the order of the tables of fields.h.
#define GROUSER_ARRAY(Message, name) \
  { #name, &v1alpha1::Message::name, &v1alpha1::Message::mutable_##name }
constexpr std::array<Array<v1alpha1::Motions>, kMotionFields.size()> kMotionArrays = {
    {GROUSER_ARRAY(Motions, acceleration_m_per_s2),
     GROUSER_ARRAY(Motions, yaw_acceleration_rad_per_s2), GROUSER_ARRAY(Motions, grade_rad),
     GROUSER_ARRAY(Motions, bank_rad), GROUSER_ARRAY(Motions, worse_by_sd)}};
constexpr std::array<Array<v1alpha1::Solutions>, kSolutionFields.size()> kSolutionArrays = {
    {GROUSER_ARRAY(Solutions, residual), GROUSER_ARRAY(Solutions, v_x_m_per_s),
     GROUSER_ARRAY(Solutions, v_y_m_per_s), GROUSER_ARRAY(Solutions, yaw_rate_rad_per_s),
     GROUSER_ARRAY(Solutions, side_slip_rad), GROUSER_ARRAY(Solutions, steering_rad),
     GROUSER_ARRAY(Solutions, pitching_moment_n_m), GROUSER_ARRAY(Solutions, f_x_n),
     GROUSER_ARRAY(Solutions, f_y_n), GROUSER_ARRAY(Solutions, m_z_n_m),
     GROUSER_ARRAY(Solutions, shaft_power_w), GROUSER_ARRAY(Solutions, electric_power_w),
     GROUSER_ARRAY(Solutions, tip_margin), GROUSER_ARRAY(Solutions, torque_margin),
     GROUSER_ARRAY(Solutions, sinkage_margin)}};
constexpr std::array<Array<v1alpha1::WheelSolutions>, kWheelFields.size()> kWheelArrays = {
    {GROUSER_ARRAY(WheelSolutions, load_n), GROUSER_ARRAY(WheelSolutions, rim_speed_m_per_s),
     GROUSER_ARRAY(WheelSolutions, v_x_m_per_s), GROUSER_ARRAY(WheelSolutions, v_y_m_per_s),
     GROUSER_ARRAY(WheelSolutions, slip), GROUSER_ARRAY(WheelSolutions, slip_angle_rad),
     GROUSER_ARRAY(WheelSolutions, steer_rad), GROUSER_ARRAY(WheelSolutions, f_x_n),
     GROUSER_ARRAY(WheelSolutions, f_y_n), GROUSER_ARRAY(WheelSolutions, torque_n_m),
     GROUSER_ARRAY(WheelSolutions, m_z_n_m), GROUSER_ARRAY(WheelSolutions, sinkage_m),
     GROUSER_ARRAY(WheelSolutions, shaft_power_w)}};
constexpr std::array<Array<v1alpha1::Powers>, kPowerFields.size()> kPowerArrays = {
    {GROUSER_ARRAY(Powers, electric_w), GROUSER_ARRAY(Powers, shaft_w),
     GROUSER_ARRAY(Powers, drive_w), GROUSER_ARRAY(Powers, rolling_w),
     GROUSER_ARRAY(Powers, slip_w), GROUSER_ARRAY(Powers, scrub_w), GROUSER_ARRAY(Powers, grade_w),
     GROUSER_ARRAY(Powers, acceleration_w), GROUSER_ARRAY(Powers, imbalance_w)}};
constexpr std::array<Array<v1alpha1::Powers>, kIntervalFields.size()> kIntervalArrays = {
    {GROUSER_ARRAY(Powers, electric_low_w), GROUSER_ARRAY(Powers, electric_high_w),
     GROUSER_ARRAY(Powers, joules_per_metre), GROUSER_ARRAY(Powers, joules_per_metre_low),
     GROUSER_ARRAY(Powers, joules_per_metre_high)}};
#undef GROUSER_ARRAY

constexpr bool SameBit(v1alpha1::MotionReason wire, Reason ours) {
  return static_cast<std::uint32_t>(wire) == static_cast<std::uint32_t>(ours);
}
static_assert(SameBit(v1alpha1::MOTION_REASON_BALANCE, kNoBalance) &&
              SameBit(v1alpha1::MOTION_REASON_TORQUE, kOverTorque) &&
              SameBit(v1alpha1::MOTION_REASON_SINKAGE, kSinksIn) &&
              SameBit(v1alpha1::MOTION_REASON_TIP, kTips) &&
              SameBit(v1alpha1::MOTION_REASON_UNTRAINED_SPEED, kUntrainedSpeed) &&
              SameBit(v1alpha1::MOTION_REASON_MODEL_DOMAIN, kModelDomain) &&
              SameBit(v1alpha1::MOTION_REASON_INPUT, kBadInput) &&
              SameBit(v1alpha1::MotionReason_MAX, kBadInput));

template <class Message, class T, std::size_t kSize>
void AppendAll(const T& from, const std::array<NumberField<T>, kSize>& fields,
               const std::array<Array<Message>, kSize>& arrays, Message* to) {
  for (std::size_t k = 0; k < kSize; ++k) (to->*arrays[k].edit)()->Add(from.*fields[k].member);
}

template <class Message, class T, std::size_t kSize>
void ReadAll(const Message& from, std::size_t i, const std::array<NumberField<T>, kSize>& fields,
             const std::array<Array<Message>, kSize>& arrays, T* to) {
  for (std::size_t k = 0; k < kSize; ++k) {
    to->*fields[k].member = Entry((from.*arrays[k].get)(), i);
  }
}

}  // namespace

void CheckSizes(const v1alpha1::Motions& from, const DescribedVehicle& vehicle) {
  const auto n = static_cast<int>(CountOf(from, vehicle));
  const auto drives = static_cast<int>(vehicle.vehicle.drives.size());
  if (from.given_case() == v1alpha1::Motions::GIVEN_NOT_SET) {
    Refuse("motions.given", "missing", "twist or controls");
  }
  if (n == 0) Refuse("motions", "none", "1 or more");
  if (from.has_twist()) {
    CheckSize("motions.twist.yaw_rate_rad_per_s", from.twist().yaw_rate_rad_per_s_size(), n);
  } else {
    CheckSize("motions.controls.rim_speed_m_per_s", from.controls().rim_speed_m_per_s_size(),
              n * drives);
    CheckSize("motions.controls.steering_rad", from.controls().steering_rad_size(), n);
  }
  for (const auto& array : kMotionArrays) {
    CheckSize(std::string("motions.") + array.name, (from.*array.get)().size(), n);
  }
  CheckSize("motions.draw", from.draw_size(), n);
  const int by_wheel = n * static_cast<int>(vehicle.vehicle.wheels.size());
  if (from.soil_size() != by_wheel) CheckSize("motions.soil", from.soil_size(), n);
}

std::size_t CountOf(const v1alpha1::Motions& from, const DescribedVehicle& vehicle) {
  if (from.has_twist()) return static_cast<std::size_t>(from.twist().v_x_m_per_s_size());
  const auto entries = static_cast<std::size_t>(from.controls().rim_speed_m_per_s_size());
  const std::size_t drives = vehicle.vehicle.drives.size();
  return (entries + drives - 1) / drives;
}

std::vector<Motion> FromMessage(const v1alpha1::Motions& from, const DescribedVehicle& vehicle) {
  CheckSizes(from, vehicle);
  const SoilTable soils("motions", from.soils(), vehicle.soils);
  const auto wheels = static_cast<int>(vehicle.vehicle.wheels.size());
  const auto drives = static_cast<int>(vehicle.vehicle.drives.size());
  const auto n = static_cast<int>(CountOf(from, vehicle));
  std::vector<Motion> motions(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    Motion& m = motions[static_cast<std::size_t>(i)];
    if (from.has_twist()) {
      m.v_x_m_per_s = from.twist().v_x_m_per_s(i);
      m.yaw_rate_rad_per_s = EntryOr0(from.twist().yaw_rate_rad_per_s(), i);
    } else {
      m.given = Motion::Given::kControls;
      for (int d = 0; d < drives; ++d) {
        m.rim_speed_m_per_s[static_cast<std::size_t>(d)] =
            from.controls().rim_speed_m_per_s(i * drives + d);
      }
      m.steering_rad = EntryOr0(from.controls().steering_rad(), i);
    }
    for (std::size_t k = 0; k < kMotionArrays.size(); ++k) {
      m.*kMotionFields[k].member = EntryOr0((from.*kMotionArrays[k].get)(), i);
    }
    if (!from.draw().empty()) m.draw = from.draw(i);
    m.soil.fill(soils.first());
    for (int w = 0; w < wheels && !from.soil().empty(); ++w) {
      const int at = from.soil_size() == n ? i : i * wheels + w;
      m.soil[static_cast<std::size_t>(w)] = soils.At("motions.soil", at, from.soil(at));
    }
  }
  return motions;
}

void Append(const Motion& m, const DescribedVehicle& vehicle, v1alpha1::Motions* to) {
  if (m.given == Motion::Given::kTwist) {
    to->mutable_twist()->add_v_x_m_per_s(m.v_x_m_per_s);
    to->mutable_twist()->add_yaw_rate_rad_per_s(m.yaw_rate_rad_per_s);
  } else {
    for (std::size_t d = 0; d < vehicle.vehicle.drives.size(); ++d) {
      to->mutable_controls()->add_rim_speed_m_per_s(m.rim_speed_m_per_s[d]);
    }
    to->mutable_controls()->add_steering_rad(m.steering_rad);
  }
  AppendAll(m, kMotionFields, kMotionArrays, to);
  to->add_draw(m.draw);
  for (std::size_t w = 0; w < vehicle.vehicle.wheels.size(); ++w) to->add_soil(m.soil[w]);
}

void Append(const Solution& s, const DescribedVehicle& vehicle, v1alpha1::Solutions* to) {
  to->add_reasons(s.reasons);
  AppendAll(s, kSolutionFields, kSolutionArrays, to);
  for (std::size_t d = 0; d < vehicle.vehicle.drives.size(); ++d) {
    to->add_rim_speed_m_per_s(s.rim_speed_m_per_s[d]);
  }
  for (std::size_t w = 0; w < vehicle.vehicle.wheels.size(); ++w) {
    AppendAll(s.wheel[w], kWheelFields, kWheelArrays, to->mutable_wheels());
    to->mutable_wheels()->add_flags(s.wheel[w].flags);
  }
}

Solution SolutionAt(const v1alpha1::Solutions& from, const DescribedVehicle& vehicle,
                    std::size_t i) {
  Solution s;
  s.reasons = Entry(from.reasons(), i);
  ReadAll(from, i, kSolutionFields, kSolutionArrays, &s);
  s.balanced = s.residual <= Solution::kTolerance;
  const std::size_t drives = vehicle.vehicle.drives.size(), wheels = vehicle.vehicle.wheels.size();
  for (std::size_t d = 0; d < drives; ++d) {
    s.rim_speed_m_per_s[d] = Entry(from.rim_speed_m_per_s(), i * drives + d);
  }
  for (std::size_t w = 0; w < wheels; ++w) {
    ReadAll(from.wheels(), i * wheels + w, kWheelFields, kWheelArrays, &s.wheel[w]);
    s.wheel[w].flags = Entry(from.wheels().flags(), i * wheels + w);
  }
  return s;
}

void Append(const PowerInterval& p, const DescribedVehicle& vehicle, v1alpha1::Powers* to) {
  to->add_reasons(p.solution.reasons);
  to->add_residual(p.solution.residual);
  AppendAll(p.mean, kPowerFields, kPowerArrays, to);
  AppendAll(p, kIntervalFields, kIntervalArrays, to);
  for (std::size_t w = 0; w < vehicle.vehicle.wheels.size(); ++w) {
    to->add_wheel_shaft_w(p.mean.wheel[w]);
  }
}

PowerInterval PowerAt(const v1alpha1::Powers& from, const DescribedVehicle& vehicle,
                      std::size_t i) {
  PowerInterval p;
  p.solution.reasons = Entry(from.reasons(), i);
  p.solution.residual = Entry(from.residual(), i);
  p.solution.balanced = p.solution.residual <= Solution::kTolerance;
  ReadAll(from, i, kPowerFields, kPowerArrays, &p.mean);
  ReadAll(from, i, kIntervalFields, kIntervalArrays, &p);
  p.speed_m_per_s = SpeedOf(p.mean.electric, p.joules_per_metre, 0);
  const std::size_t wheels = vehicle.vehicle.wheels.size();
  for (std::size_t w = 0; w < wheels; ++w) {
    p.mean.wheel[w] = Entry(from.wheel_shaft_w(), i * wheels + w);
  }
  return p;
}

}  // namespace grouser::vehicle
