#include "surrogate/vehicle/energy.h"

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

PowerInterval PowerOf(Solver* solver, const Motion& motion, double sds) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const Vehicle& v = solver->vehicle();
  PowerInterval out;
  // Once more from there, as near to balance as it goes.
  const Effort refine{.warm = true, .goal = 1e-11};
  const std::array<Solution, 3> solutions = SolveSpread(solver, motion, sds, &refine);
  out.solution = solutions[0];
  out.mean = PowerOf(v, motion, solutions[0]);
  const auto electric = [&](const Solution& s) { return s.balanced ? s.electric_power_w : kNaN; };
  std::tie(out.electric_low, out.electric_high) =
      EndsOf(electric(solutions[1]), electric(solutions[2]));
  const Solution& s = solutions[0];
  const double speed = std::hypot(s.v_x_m_per_s - s.yaw_rate_rad_per_s * v.centre_y_m,
                                  s.v_y_m_per_s + s.yaw_rate_rad_per_s * v.centre_x_m);
  const double per = speed > 1e-9 ? 1 / speed : kNaN;
  out.joules_per_metre = out.mean.electric * per;
  out.low = out.electric_low * per;
  out.high = out.electric_high * per;
  return out;
}

}  // namespace grouser::vehicle
