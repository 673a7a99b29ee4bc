#include <algorithm>
#include <cmath>
#include <limits>

#include "surrogate/models/kinematics.h"
#include "surrogate/vehicle/mechanics.h"
#include "surrogate/vehicle/motor.h"

namespace grouser::vehicle {

void Mechanics::Write(const Outcome& outcome, Solution* solution) const noexcept {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const Lane& lane = *outcome.lane;
  const bool brief = lane.effort.brief;
  Solution& s = *solution;
  const Twist t = TwistOf(lane, outcome.at);
  const double scale = lane.scale;
  s.v_x_m_per_s = t.v_x * scale;
  s.v_y_m_per_s = t.v_y * scale;
  s.yaw_rate_rad_per_s = t.yaw * scale;
  s.side_slip_rad =
      brief ? kNaN
            : std::atan2(t.v_y + t.yaw * vehicle_.centre_x_m, t.v_x - t.yaw * vehicle_.centre_y_m);
  s.steering_rad = t.psi;
  s.evaluations = lane.evaluations;
  s.tip_margin = outcome.tip_margin;
  s.reasons = 0;
  s.shaft_power_w = s.f_x_n = s.f_y_n = s.m_z_n_m = 0;
  double deepest = 0;
  std::uint32_t flags = 0;
  for (std::size_t i = 0; i < wheels(); ++i) {
    const WheelState& p = outcome.wheel[i];
    const WheelAnswers& f = outcome.felt[i];
    WheelSolution& w = s.wheel[i];
    w.load_n = p.load;
    w.rim_speed_m_per_s = p.rim * scale;
    w.v_x_m_per_s = p.v_x * scale;
    w.v_y_m_per_s = p.v_y * scale;
    w.f_x_n = f.f_x;
    w.f_y_n = f.f_y;
    w.torque_n_m = f.torque;
    w.m_z_n_m = f.m_z;
    w.sinkage_m = f.sinkage;
    w.shaft_power_w = f.torque * p.rim * scale / radius(i);
    w.flags = f.flags;
    w.slip = w.slip_angle_rad = w.steer_rad = kNaN;
    if (!brief) {
      const surrogate::SlipState slip = surrogate::ToSlip(p.v_x, p.v_y, p.rim);
      w.slip = slip.slip;
      w.slip_angle_rad = slip.attack_angle_rad;
      w.steer_rad = std::atan2(p.sin, p.cos);
    }
    const Wheel& at = vehicle_.wheels[i];
    s.f_x_n += p.cos * f.f_x - p.sin * f.f_y;
    s.f_y_n += p.sin * f.f_x + p.cos * f.f_y;
    s.m_z_n_m += f.f_x * (at.x_m * p.sin - at.y_m * p.cos) +
                 f.f_y * (at.x_m * p.cos + at.y_m * p.sin) + f.m_z;
    s.shaft_power_w += w.shaft_power_w;
    deepest = std::max(deepest, f.sinkage / radius(i));
    flags |= f.flags;
  }
  for (std::size_t d = 0; d < vehicle_.drives.size(); ++d) {
    const int at = lane.layout->drive[d];
    s.rim_speed_m_per_s[d] = scale * (at >= 0 ? outcome.at[static_cast<std::size_t>(at)]
                                              : lane.motion->rim_speed_m_per_s[d]);
  }
  s.pitching_moment_n_m = outcome.at[static_cast<std::size_t>(lane.layout->moment)];
  s.sinkage_margin = 1 - deepest / vehicle_.sinkage_limit;
  WriteDrives(&s);

  using surrogate::kExtrapolated, surrogate::kInvalid, surrogate::kNoEquilibrium, surrogate::kRate;
  if (s.tip_margin <= 0) s.reasons |= kTips;
  if ((flags & kNoEquilibrium) != 0 || s.sinkage_margin < 0) s.reasons |= kSinksIn;
  if ((flags & kExtrapolated) != 0) s.reasons |= kModelDomain;
  if ((flags & kRate) != 0) s.reasons |= kUntrainedSpeed;
  if ((flags & kInvalid) != 0) s.reasons |= kModelDomain;
}

void Mechanics::WriteDrives(Solution* s) const noexcept {
  double use = vehicle_.steered() ? std::fabs(s->steering_rad) / vehicle_.steering.limit_rad : 0;
  s->electric_power_w = 0;
  for (std::size_t d = 0; d < vehicle_.drives.size(); ++d) {
    const vehicle::Drive& drive = vehicle_.drives[d];
    double torque = 0, spin = 0, count = 0;
    const auto add = [&](double t, double w) {
      const MotorState state = StateOf(drive.motor, t, w);
      s->electric_power_w += state.electric_power_w;
      use = std::max(use, state.use);
    };
    for (std::size_t i = 0; i < wheels(); ++i) {
      if (vehicle_.wheels[i].drive != static_cast<int>(d)) continue;
      const WheelSolution& w = s->wheel[i];
      if (drive.coupling == Coupling::kIndependent) {
        add(w.torque_n_m, w.rim_speed_m_per_s / radius(i));
        continue;
      }
      torque += w.torque_n_m;
      spin += w.rim_speed_m_per_s / radius(i);
      ++count;
    }
    if (count > 0) add(torque, spin / count);
  }
  s->torque_margin = 1 - use;
  if (use > 1) s->reasons |= kOverTorque;
}

}  // namespace grouser::vehicle
