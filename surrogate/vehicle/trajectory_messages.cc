#include "surrogate/vehicle/trajectory_messages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "surrogate/vehicle/message_checks.h"

namespace grouser::vehicle {
namespace {

using v1alpha1::Trajectories;

struct NumbersOf {
  const char* name;
  const Numbers& (Trajectories::*get)() const;
  Numbers* (Trajectories::*change)();
};
constexpr std::array<NumbersOf, 9> kNumbers = {
    {{"trajectories.v_x_m_per_s", &Trajectories::v_x_m_per_s, &Trajectories::mutable_v_x_m_per_s},
     {"trajectories.yaw_rate_rad_per_s", &Trajectories::yaw_rate_rad_per_s,
      &Trajectories::mutable_yaw_rate_rad_per_s},
     {"trajectories.curvature_per_m", &Trajectories::curvature_per_m,
      &Trajectories::mutable_curvature_per_m},
     {"trajectories.duration_s", &Trajectories::duration_s, &Trajectories::mutable_duration_s},
     {"trajectories.length_m", &Trajectories::length_m, &Trajectories::mutable_length_m},
     {"trajectories.acceleration_m_per_s2", &Trajectories::acceleration_m_per_s2,
      &Trajectories::mutable_acceleration_m_per_s2},
     {"trajectories.yaw_acceleration_rad_per_s2", &Trajectories::yaw_acceleration_rad_per_s2,
      &Trajectories::mutable_yaw_acceleration_rad_per_s2},
     {"trajectories.grade_rad", &Trajectories::grade_rad, &Trajectories::mutable_grade_rad},
     {"trajectories.bank_rad", &Trajectories::bank_rad, &Trajectories::mutable_bank_rad}}};

void CheckSize(const std::string& field, int size, const TrajectoryCounts& count) {
  const auto entries = static_cast<std::size_t>(size);
  if (entries <= 1 || entries == count.longest || entries == count.steps) return;
  Refuse(field, std::to_string(size) + " entries",
         std::to_string(count.steps) + " (all steps), " + std::to_string(count.longest) +
             " (those of the longest), 1 or none");
}

void CheckDurations(const Numbers& durations) {
  for (int i = 0; i < durations.size(); ++i) {
    if (durations[i] <= kLongestStepS) continue;
    Refuse(EntryName("trajectories.duration_s", i), std::to_string(durations[i]),
           "at most 1e9 seconds");
  }
}

/// Entries that all have the same bits.
template <class Array>
bool Alike(const Array& array) {
  using Entry = typename Array::value_type;
  return std::all_of(array.begin(), array.end(), [&array](const Entry& entry) {
    return std::memcmp(&entry, &array[0], sizeof entry) == 0;
  });
}

void CheckTogether(const char* one, const Numbers& a, const char* other, const Numbers& b) {
  if (a.empty() || b.empty()) return;
  Refuse(std::string("trajectories.") + one, std::to_string(a.size()) + " entries beside " + other,
         "one of the two");
}

}  // namespace

TrajectoryCounts CountOf(const Trajectories& from) {
  if (from.steps().empty()) Refuse("trajectories.steps", "none", "1 or more");
  TrajectoryCounts count;
  for (int k = 0; k < from.steps_size(); ++k) {
    if (from.steps(k) == 0) Refuse(EntryName("trajectories.steps", k), "0", "1 or more");
    count.steps += from.steps(k);
    count.longest = std::max<std::size_t>(count.longest, from.steps(k));
  }
  count.trajectories = static_cast<std::size_t>(from.steps_size());
  return count;
}

void CheckSizes(const Trajectories& from) {
  const TrajectoryCounts count = CountOf(from);
  for (const NumbersOf& n : kNumbers) CheckSize(n.name, (from.*n.get)().size(), count);
  CheckSize("trajectories.soil", from.soil_size(), count);
  if (from.v_x_m_per_s().empty()) Refuse("trajectories.v_x_m_per_s", "none", "1 or more");
  CheckTogether("curvature_per_m", from.curvature_per_m(), "yaw_rate_rad_per_s",
                from.yaw_rate_rad_per_s());
  CheckTogether("length_m", from.length_m(), "duration_s", from.duration_s());
  if (from.duration_s().empty() && from.length_m().empty()) {
    Refuse("trajectories.duration_s", "none, and no length_m", "one of the two");
  }
}

TrajectoryReader::TrajectoryReader(const Trajectories& from, const DescribedVehicle& vehicle,
                                   double worse_by_sd)
    : from_(from), worse_by_sd_(worse_by_sd), steps_(from.steps().begin(), from.steps().end()) {
  CheckSizes(from);
  for (const NumbersOf& n : kNumbers) CheckFinite(n.name, (from.*n.get)());
  CheckAbove0("trajectories.duration_s", from.duration_s());
  CheckDurations(from.duration_s());
  CheckAbove0("trajectories.length_m", from.length_m());
  const SoilTable soils("trajectories", from.soils(), vehicle.soils);
  for (int i = 0; i < from.soil_size(); ++i) {
    soils_.push_back(soils.At("trajectories.soil", i, from.soil(i)));
  }
  if (soils_.empty()) soils_.push_back(soils.first());
  n_ = CountOf(from).steps;
  for (; !from.length_m().empty() && all_ < n_; Advance()) {
    const double v_x = At(from.v_x_m_per_s());
    if (!(DurationOf(v_x) <= kLongestStepS)) {
      Refuse("trajectories.v_x_m_per_s: at step " + std::to_string(all_) + " of all",
             std::to_string(v_x),
             "a speed that takes the step's length_m to its end within 1e9 seconds");
    }
  }
  trajectory_ = step_ = all_ = 0;
}

// Of the next step: of all steps, of the steps by number, of one for all, 0.
double TrajectoryReader::At(const Numbers& numbers) const {
  if (numbers.size() <= 1) return numbers.empty() ? 0 : numbers[0];
  const bool each = static_cast<std::size_t>(numbers.size()) == n_;
  return numbers[static_cast<int>(each ? all_ : step_)];
}

double TrajectoryReader::DurationOf(double v_x) const {
  return from_.length_m().empty() ? At(from_.duration_s()) : At(from_.length_m()) / std::fabs(v_x);
}

void TrajectoryReader::Advance() {
  ++all_;
  if (++step_ < steps_[trajectory_]) return;
  ++trajectory_;
  step_ = 0;
}

TrajectoryStep TrajectoryReader::Next() {
  TrajectoryStep next;
  Motion& m = next.motion;
  m.v_x_m_per_s = At(from_.v_x_m_per_s());
  m.yaw_rate_rad_per_s = from_.curvature_per_m().empty()
                             ? At(from_.yaw_rate_rad_per_s())
                             : m.v_x_m_per_s * At(from_.curvature_per_m());
  m.acceleration_m_per_s2 = At(from_.acceleration_m_per_s2());
  m.yaw_acceleration_rad_per_s2 = At(from_.yaw_acceleration_rad_per_s2());
  m.grade_rad = At(from_.grade_rad());
  m.bank_rad = At(from_.bank_rad());
  m.worse_by_sd = worse_by_sd_;
  const bool each = soils_.size() == n_;
  m.soil.fill(soils_[soils_.size() == 1 ? 0 : each ? all_ : step_]);
  next.duration_s = DurationOf(m.v_x_m_per_s);
  Advance();
  return next;
}

void Append(std::span<const TrajectoryStep> steps, Trajectories* to) {
  to->add_steps(static_cast<std::uint32_t>(steps.size()));
  for (const TrajectoryStep& step : steps) {
    const Motion& m = step.motion;
    const bool one_soil = std::all_of(m.soil.begin(), m.soil.end(),
                                      [&m](std::uint8_t soil) { return soil == m.soil[0]; });
    if (m.given != Motion::Given::kTwist || m.draw != Motion::kMeanGround || m.worse_by_sd != 0 ||
        !one_soil) {
      Refuse("trajectories", "a step with rim speeds, a draw, worse ground or several soils",
             "a twist on the mean of one soil");
    }
    to->add_v_x_m_per_s(m.v_x_m_per_s);
    to->add_yaw_rate_rad_per_s(m.yaw_rate_rad_per_s);
    to->add_duration_s(step.duration_s);
    to->add_acceleration_m_per_s2(m.acceleration_m_per_s2);
    to->add_yaw_acceleration_rad_per_s2(m.yaw_acceleration_rad_per_s2);
    to->add_grade_rad(m.grade_rad);
    to->add_bank_rad(m.bank_rad);
    to->add_soil(m.soil[0]);
  }
}

void Shorten(Trajectories* trajectories) {
  for (const NumbersOf& n : kNumbers) {
    Numbers& numbers = *(trajectories->*n.change)();
    if (numbers.size() > 1 && Alike(numbers)) numbers.Truncate(1);
  }
  auto& soil = *trajectories->mutable_soil();
  if (soil.size() > 1 && Alike(soil)) soil.Truncate(1);
}

void Append(const TrajectoryCost& c, v1alpha1::TrajectoryCosts* to) {
  to->add_duration_s(c.duration_s);
  to->add_energy_j(c.energy.joules);
  to->add_energy_low_j(c.energy.low);
  to->add_energy_high_j(c.energy.high);
  to->add_distance_m(c.energy.metres);
  to->add_energy_duration_s(c.energy.seconds);
  to->add_steps_left_out(static_cast<std::uint32_t>(c.energy.left_out));
  to->add_duration_left_out_s(c.energy.left_out_s);
  to->add_reasons(c.reasons);
  to->add_first_step(c.first_step);
  to->add_first_reasons(c.first_reasons);
  to->add_least_margin(c.least_margin);
  to->add_least_margin_of(static_cast<v1alpha1::MotionReason>(c.least_margin_of));
  to->add_least_margin_step(c.least_margin_step);
}

TrajectoryCost CostAt(const v1alpha1::TrajectoryCosts& from, std::size_t i) {
  TrajectoryCost c;
  c.duration_s = Entry(from.duration_s(), i);
  c.energy.joules = Entry(from.energy_j(), i);
  c.energy.low = Entry(from.energy_low_j(), i);
  c.energy.high = Entry(from.energy_high_j(), i);
  c.energy.metres = Entry(from.distance_m(), i);
  c.energy.seconds = Entry(from.energy_duration_s(), i);
  c.energy.left_out = Entry(from.steps_left_out(), i);
  c.energy.left_out_s = Entry(from.duration_left_out_s(), i);
  c.reasons = Entry(from.reasons(), i);
  c.first_step = Entry(from.first_step(), i);
  c.first_reasons = Entry(from.first_reasons(), i);
  c.least_margin = Entry(from.least_margin(), i);
  c.least_margin_of = static_cast<std::uint32_t>(Entry(from.least_margin_of(), i));
  c.least_margin_step = Entry(from.least_margin_step(), i);
  return c;
}

void Append(const PowerInterval& p, v1alpha1::TrajectorySteps* to) {
  const Solution& s = p.solution;
  to->add_reasons(s.reasons);
  to->add_residual(s.residual);
  to->add_electric_w(p.mean.electric);
  to->add_electric_low_w(p.electric_low);
  to->add_electric_high_w(p.electric_high);
  to->add_tip_margin(s.tip_margin);
  to->add_torque_margin(s.torque_margin);
  to->add_sinkage_margin(s.sinkage_margin);
}

}  // namespace grouser::vehicle
