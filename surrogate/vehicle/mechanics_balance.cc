#include <algorithm>
#include <cmath>

#include "surrogate/models/kinematics.h"
#include "surrogate/vehicle/mechanics.h"
#include "surrogate/vehicle/motor.h"

namespace grouser::vehicle {
namespace {

// d output/d unknown k of a wheel: the chain rule over its state.
double Along(const std::array<double, 5>& felt, const Placed& p, std::size_t k) {
  return felt[1] * p.d_v_x[k] + felt[2] * p.d_v_y[k] + felt[3] * p.d_rim[k] + felt[4] * p.d_load[k];
}

// Adds a wheel's part of the derivatives of the first four rows.
template <std::size_t kSize>
void AddWheel(const Placed& p, const Felt& f, const Wheel& wheel, double radius, int psi,
              std::size_t size, std::array<Column, kMostUnknowns>* jacobian) {
  auto& j = *jacobian;
  const double arm = radius - f.sinkage;
  const std::size_t n = kSize > 0 ? kSize : size;
  for (std::size_t k = 0; k < n; ++k) {
    const double along = Along(f.f_x, p, k), across = Along(f.f_y, p, k);
    const double x = p.cos * along - p.sin * across, y = p.sin * along + p.cos * across;
    j[0][k] += x;
    j[1][k] += y;
    j[2][k] += wheel.x_m * y - wheel.y_m * x + Along(f.m_z, p, k);
    j[3][k] -= p.cos * (arm * along - Along(f.torque, p, k));
  }
  if (psi < 0) return;
  const auto k = static_cast<std::size_t>(psi);
  const double x = -(p.sin * f.f_x[0] + p.cos * f.f_y[0]) * p.steer_slope;
  const double y = (p.cos * f.f_x[0] - p.sin * f.f_y[0]) * p.steer_slope;
  j[0][k] += x;
  j[1][k] += y;
  j[2][k] += wheel.x_m * y - wheel.y_m * x;
  j[3][k] += p.sin * p.steer_slope * (arm * f.f_x[0] - f.torque[0]);
}

}  // namespace

// Rows: forces along x and y, moment about z, pitching moment; then those of free rims and
// differentials.
void Mechanics::Imbalance(const Lane& lane, std::span<const Felt> felt, Column* residual,
                          std::array<Column, kMostUnknowns>* jacobian) const noexcept {
  const Layout& l = *lane.layout;
  Column& r = *residual;
  r.fill(0);
  r[0] = -lane.f_x;
  r[1] = -lane.f_y;
  r[2] = -lane.m_z;
  r[3] = lane.at[static_cast<std::size_t>(l.moment)];
  for (std::size_t i = 0; i < wheels(); ++i) {
    const Placed& p = lane.placed[i];
    const Felt& f = felt[i];
    const double x = p.cos * f.f_x[0] - p.sin * f.f_y[0], y = p.sin * f.f_x[0] + p.cos * f.f_y[0];
    r[0] += x;
    r[1] += y;
    r[2] += vehicle_.wheels[i].x_m * y - vehicle_.wheels[i].y_m * x + f.m_z[0];
    r[3] -= p.cos * ((radius(i) - f.sinkage) * f.f_x[0] - f.torque[0]);
  }
  const double per[4] = {1 / weight_, 1 / weight_, 1 / (weight_ * length_),
                         1 / (weight_ * mean_radius_)};
  for (std::size_t row = 0; row < 4; ++row) r[row] *= per[row];
  if (jacobian != nullptr) {
    auto& j = *jacobian;
    for (std::size_t row = 0; row < l.size; ++row) {
      for (std::size_t k = 0; k < l.size; ++k) j[row][k] = 0;
    }
    // What gravity and inertia ask for changes with the twist.
    const double m = vehicle_.mass_kg, xg = vehicle_.centre_x_m, yg = vehicle_.centre_y_m;
    const double yaw = l.v_x >= 0 ? lane.at[2] : lane.yaw;
    double by_f_x[3] = {-m * yaw, 0, 0}, by_f_y[3] = {0, 0, 0};
    if (l.v_x >= 0) {
      by_f_x[2] = -m * (lane.at[0] + 2 * yaw * xg);
      by_f_y[1] = m * yaw;
      by_f_y[2] = m * (lane.at[1] - 2 * yaw * yg);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      j[0][k] = -by_f_x[k];
      j[1][k] = -by_f_y[k];
      j[2][k] = -(xg * by_f_y[k] - yg * by_f_x[k]);
    }
    j[3][static_cast<std::size_t>(l.moment)] = 1;
    for (std::size_t i = 0; i < wheels(); ++i) {
      const Wheel& w = vehicle_.wheels[i];
      if (l.size == 4) {  // most vehicles: a number that the compiler knows
        AddWheel<4>(lane.placed[i], felt[i], w, radius(i), l.psi, 4, &j);
      } else {
        AddWheel<0>(lane.placed[i], felt[i], w, radius(i), l.psi, l.size, &j);
      }
    }
    for (std::size_t row = 0; row < 4; ++row) {
      for (std::size_t k = 0; k < l.size; ++k) j[row][k] *= per[row] * lane.unit[k];
    }
  }
  if (l.size > 4) FreeRows(lane, felt, residual, jacobian);
}

// Wheels with a speed of their own: without a drive the torque is 0; behind a differential all
// torques are equal and the drive has their mean speed.
void Mechanics::FreeRows(const Lane& lane, std::span<const Felt> felt, Column* residual,
                         std::array<Column, kMostUnknowns>* jacobian) const noexcept {
  const Layout& l = *lane.layout;
  const double per = 1 / (weight_ * mean_radius_);
  for (std::size_t i = 0; i < wheels(); ++i) {
    if (l.rim[i] < 0) continue;
    const auto row = static_cast<std::size_t>(l.rim[i]);
    const int drive = vehicle_.wheels[i].drive;
    const std::size_t first = drive < 0 ? i : first_[static_cast<std::size_t>(drive)];
    Column* slope = jacobian != nullptr ? &(*jacobian)[row] : nullptr;
    if (drive < 0 || first != i) {
      (*residual)[row] = felt[i].torque[0] * per;
      if (drive >= 0) (*residual)[row] -= felt[first].torque[0] * per;
      for (std::size_t k = 0; slope != nullptr && k < l.size; ++k) {
        double along = Along(felt[i].torque, lane.placed[i], k);
        if (drive >= 0) along -= Along(felt[first].torque, lane.placed[first], k);
        (*slope)[k] = along * per * lane.unit[k];
      }
      continue;
    }
    double sum = 0, count = 0;
    for (std::size_t w = 0; w < wheels(); ++w) {
      if (vehicle_.wheels[w].drive != drive) continue;
      sum += lane.placed[w].rim;
      ++count;
    }
    const auto d = static_cast<std::size_t>(drive);
    (*residual)[row] = (sum / count - DriveSpeed(lane, d)) / lane.speed;
    if (slope == nullptr) continue;
    for (std::size_t w = 0; w < wheels(); ++w) {
      if (vehicle_.wheels[w].drive != drive) continue;
      const auto k = static_cast<std::size_t>(l.rim[w]);
      (*slope)[k] = lane.unit[k] / (count * lane.speed);
    }
    if (l.drive[d] >= 0) {
      const auto k = static_cast<std::size_t>(l.drive[d]);
      (*slope)[k] = -lane.unit[k] / lane.speed;
    }
  }
}

void Mechanics::Write(const Lane& lane, std::span<const Felt> felt) const noexcept {
  Solution& s = *lane.solution;
  const Twist t = TwistOf(lane);
  const double scale = lane.scale;
  s.v_x_m_per_s = t.v_x * scale;
  s.v_y_m_per_s = t.v_y * scale;
  s.yaw_rate_rad_per_s = t.yaw * scale;
  s.side_slip_rad =
      std::atan2(t.v_y + t.yaw * vehicle_.centre_x_m, t.v_x - t.yaw * vehicle_.centre_y_m);
  s.steering_rad = t.psi;
  s.evaluations = lane.evaluations;
  s.tip_margin = lane.tip_margin;
  s.f_x_n = s.f_y_n = s.m_z_n_m = s.shaft_power_w = 0;
  s.reasons = 0;
  double deepest = 0;
  std::uint32_t flags = 0;
  for (std::size_t i = 0; i < wheels(); ++i) {
    const Placed& p = lane.placed[i];
    const Felt& f = felt[i];
    WheelSolution& w = s.wheel[i];
    const surrogate::SlipState slip = surrogate::ToSlip(p.v_x, p.v_y, p.rim);
    w = {p.load,
         p.rim * scale,
         p.v_x * scale,
         p.v_y * scale,
         slip.slip,
         slip.attack_angle_rad,
         p.steer,
         f.f_x[0],
         f.f_y[0],
         f.torque[0],
         f.m_z[0],
         f.sinkage,
         f.torque[0] * p.rim * scale / radius(i),
         f.flags};
    const double x = p.cos * f.f_x[0] - p.sin * f.f_y[0], y = p.sin * f.f_x[0] + p.cos * f.f_y[0];
    s.f_x_n += x;
    s.f_y_n += y;
    s.m_z_n_m += vehicle_.wheels[i].x_m * y - vehicle_.wheels[i].y_m * x + f.m_z[0];
    s.shaft_power_w += w.shaft_power_w;
    deepest = std::max(deepest, f.sinkage / radius(i));
    flags |= f.flags;
  }
  for (std::size_t d = 0; d < vehicle_.drives.size(); ++d) {
    s.rim_speed_m_per_s[d] = DriveSpeed(lane, d) * scale;
  }
  s.pitching_moment_n_m = lane.at[static_cast<std::size_t>(lane.layout->moment)];
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
