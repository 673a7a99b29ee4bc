#include "surrogate/vehicle/energy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "surrogate/vehicle/ground_spread.h"

namespace grouser::vehicle {

Power PowerOf(const Vehicle& v, const Motion& m, const Solution& s) noexcept {
  Power p;
  p.electric = s.electric_power_w;
  p.shaft = s.shaft_power_w;
  p.drive = p.electric - p.shaft;
  for (std::size_t i = 0; i < v.wheels.size(); ++i) {
    const WheelSolution& w = s.wheel[i];
    const double radius = v.wheel_types[v.wheels[i].type].radius_m;
    p.wheel[i] = w.shaft_power_w;
    p.rolling += (w.torque_n_m - radius * w.f_x_n) * w.rim_speed_m_per_s / radius;
    p.slip += w.f_x_n * (w.rim_speed_m_per_s - w.v_x_m_per_s);
    p.scrub -= w.f_y_n * w.v_y_m_per_s + w.m_z_n_m * s.yaw_rate_rad_per_s;
  }
  const double yaw = s.yaw_rate_rad_per_s;
  const double x = s.v_x_m_per_s - yaw * v.centre_y_m, y = s.v_y_m_per_s + yaw * v.centre_x_m;
  const double g = v.gravity_m_per_s2;
  p.grade = v.mass_kg * g *
            (std::sin(m.grade_rad) * x + std::cos(m.grade_rad) * std::sin(m.bank_rad) * y);
  p.acceleration =
      v.mass_kg * ((m.acceleration_m_per_s2 - m.yaw_acceleration_rad_per_s2 * v.centre_y_m) * x +
                   m.yaw_acceleration_rad_per_s2 * v.centre_x_m * y) +
      v.yaw_inertia_kg_m2 * m.yaw_acceleration_rad_per_s2 * yaw;
  p.imbalance = s.f_x_n * s.v_x_m_per_s + s.f_y_n * s.v_y_m_per_s + s.m_z_n_m * yaw - p.grade -
                p.acceleration;
  return p;
}

double SpeedOf(double watts, double joules_per_metre, double otherwise) noexcept {
  const double speed = watts / joules_per_metre;
  return std::isfinite(speed) ? speed : otherwise;
}

namespace {

PowerInterval IntervalOf(const Vehicle& v, const Motion& motion, const Solution& mean,
                         const Solution& better, const Solution& worse) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  PowerInterval out;
  out.solution = mean;
  out.mean = PowerOf(v, motion, mean);
  const auto electric = [&](const Solution& s) { return s.balanced ? s.electric_power_w : kNaN; };
  std::tie(out.electric_low, out.electric_high) = EndsOf(electric(better), electric(worse));
  const double speed = std::hypot(mean.v_x_m_per_s - mean.yaw_rate_rad_per_s * v.centre_y_m,
                                  mean.v_y_m_per_s + mean.yaw_rate_rad_per_s * v.centre_x_m);
  const bool moves = speed > 1e-9;
  const double per = moves ? 1 / speed : kNaN;
  out.joules_per_metre = out.mean.electric * per;
  out.low = out.electric_low * per;
  out.high = out.electric_high * per;
  out.speed_m_per_s = SpeedOf(out.mean.electric, out.joules_per_metre, moves ? speed : 0);
  return out;
}

// `room` and `solutions` as of SolveSpreads.
void WritePowers(Solver* solver, std::span<const Motion> motions, double sds,
                 std::span<Motion> room, std::span<Solution> solutions,
                 std::span<PowerInterval> out, const StopWhen& stop) {
  const std::size_t n = motions.size();
  // Once more from there, as near to balance as it goes.
  const Effort refine{.warm = true, .goal = 1e-11};
  SolveSpreads(solver, motions, sds, room, solutions, &refine, stop);
  const std::size_t to_better = sds == 0 ? 0 : n, to_worse = 2 * to_better;
  for (std::size_t i = 0; i < n; ++i) {
    out[i] = IntervalOf(solver->vehicle(), motions[i], solutions[i], solutions[to_better + i],
                        solutions[to_worse + i]);
  }
}

}  // namespace

PowerInterval PowerOf(Solver* solver, const Motion& motion, double sds) {
  std::array<Motion, 3> room;
  std::array<Solution, 3> solutions;
  PowerInterval out;
  WritePowers(solver, {&motion, 1}, sds, room, solutions, {&out, 1}, {});
  return out;
}

PowerBatch::PowerBatch(Solver* solver, std::size_t most)
    : solver_(solver),
      asked_(3 * std::min(most, kMost)),
      room_(asked_.size()),
      solutions_(room_.size()),
      powers_(asked_.size()) {}

std::span<const PowerInterval> PowerBatch::Of(std::span<const Motion> motions, double sds,
                                              const StopWhen& stop) {
  const std::span<PowerInterval> out = std::span(powers_).first(motions.size());
  WritePowers(solver_, motions, sds, room_, solutions_, out, stop);
  return out;
}

void DriveEnergy::Add(const PowerInterval& p, double duration_s) {
  const bool answered = p.solution.balanced && std::isfinite(p.mean.electric) &&
                        std::isfinite(p.electric_low) && std::isfinite(p.electric_high);
  if (!answered) {
    ++left_out;
    left_out_s += duration_s;
    return;
  }
  joules += p.mean.electric * duration_s;
  low += p.electric_low * duration_s;
  high += p.electric_high * duration_s;
  seconds += duration_s;
  metres += p.speed_m_per_s * duration_s;
}

}  // namespace grouser::vehicle
