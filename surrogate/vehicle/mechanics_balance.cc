#include <algorithm>
#include <cmath>
#include <limits>

#include "surrogate/models/kinematics.h"
#include "surrogate/vehicle/mechanics.h"
#include "surrogate/vehicle/motor.h"

namespace grouser::vehicle {
namespace {

// Adds, column by column, what the unknowns do to an answer of a wheel (or to four): the chain rule
// over its state. by: the answer and its derivatives by v_x, v_y, rim speed and load.
template <typename T>
[[gnu::always_inline]] inline void AddChain(const std::array<T, 5>& by, const Placed& p,
                                            const Wheel& wheel, const Layout& l, T* column) {
  column[0] += p.sin * by[1] + p.cos * by[2] + p.load_by_v_y * by[4];
  if (l.v_x >= 0) {
    column[1] += p.cos * by[1] - p.sin * by[2] + p.load_by_v_x * by[4];
    column[2] += (p.sin * wheel.x_m - p.cos * wheel.y_m) * by[1] +
                 (p.cos * wheel.x_m + p.sin * wheel.y_m) * by[2] + p.load_by_yaw * by[4];
  } else if (l.psi >= 0) {
    column[1] += p.steer_slope * (p.v_y * by[1] - p.v_x * by[2]) + p.rim_by_psi * by[3];
  }
  if (p.own >= 0) column[p.own] += p.rim_by_own * by[3];
  column[l.moment] += p.load_by_moment * by[4];
}

// From the answers of a wheel to its part of the first four rows.
struct Turn {
  Four f_x, f_y, torque, m_z;

  Turn(const Placed& p, const Wheel& w, double arm)
      : f_x{p.cos, p.sin, w.x_m * p.sin - w.y_m * p.cos, -p.cos * arm},
        f_y{-p.sin, p.cos, w.x_m * p.cos + w.y_m * p.sin, 0},
        torque{0, 0, 0, p.cos},
        m_z{0, 0, 1, 0} {}
  [[gnu::always_inline]] void To(const Four& f, Four* rows) const {
    *rows = f[0] * f_x + f[1] * f_y + (f[2] * torque + f[3] * m_z);
  }
};

}  // namespace

// What gravity and inertia ask for changes with the twist.
void Mechanics::AddInertia(const Lane& lane, Four* columns) const noexcept {
  const Layout& l = *lane.layout;
  const double m = vehicle_.mass_kg, xg = vehicle_.centre_x_m, yg = vehicle_.centre_y_m;
  const double yaw = l.v_x >= 0 ? lane.at[2] : lane.yaw;
  const auto add = [&](std::size_t k, double by_f_x, double by_f_y) {
    columns[k] -= Four{by_f_x, by_f_y, xg * by_f_y - yg * by_f_x, 0};
  };
  add(0, -m * yaw, 0);
  columns[l.moment][3] += 1;
  if (l.v_x < 0) return;
  add(1, 0, m * yaw);
  add(2, -m * (lane.at[0] + 2 * yaw * xg), m * (lane.at[1] - 2 * yaw * yg));
}

// Rows: forces along x and y, moment about z, pitching moment; then those of free rims and
// differentials.
void Mechanics::Imbalance(const Lane& lane, std::span<const Felt> felt, Column* residual,
                          std::array<Column, kMostUnknowns>* jacobian) const noexcept {
  const Layout& l = *lane.layout;
  Four sum{-lane.f_x, -lane.f_y, -lane.m_z, lane.at[static_cast<std::size_t>(l.moment)]};
  Four columns[kMostUnknowns];
  for (std::size_t k = 0; jacobian != nullptr && k < l.size; ++k) columns[k] = Four{};
  for (std::size_t i = 0; i < wheels(); ++i) {
    const Placed& p = lane.placed[i];
    const Felt& f = felt[i];
    const Wheel& wheel = vehicle_.wheels[i];
    const double arm = radius(i) - f.sinkage;
    const Turn turn(p, wheel, arm);
    std::array<Four, 5> rows;
    turn.To(f.part[0], &rows[0]);
    sum += rows[0];
    if (jacobian == nullptr) continue;
    for (std::size_t k = 1; k < 5; ++k) turn.To(f.part[k], &rows[k]);
    AddChain(rows, p, wheel, l, columns);
    if (l.psi < 0) continue;
    const double x = -rows[0][1], y = rows[0][0];  // the forces turn with the wheel
    columns[l.psi] += p.steer_slope * Four{x, y, wheel.x_m * y - wheel.y_m * x,
                                           p.sin * (arm * f.f_x() - f.torque())};
  }
  sum *= per_;
  for (std::size_t row = 0; row < 4; ++row) (*residual)[row] = sum[row];
  if (jacobian != nullptr) {
    AddInertia(lane, columns);
    for (std::size_t k = 0; k < l.size; ++k) {
      const Four column = columns[k] * per_ * lane.unit[k];
      for (std::size_t row = 0; row < 4; ++row) (*jacobian)[row][k] = column[row];
    }
  }
  if (l.size > 4) FreeRows(lane, felt, residual, jacobian);
}

// Wheels with a speed of their own: without a drive the torque is 0; behind a differential all
// torques are equal and the drive has their mean speed.
void Mechanics::FreeRows(const Lane& lane, std::span<const Felt> felt, Column* residual,
                         std::array<Column, kMostUnknowns>* jacobian) const noexcept {
  const Layout& l = *lane.layout;
  const double per = per_[3];
  // Of a wheel's torque: value and derivatives, times a factor.
  const auto add = [&](std::size_t i, double factor, std::size_t row) {
    (*residual)[row] += factor * felt[i].torque();
    if (jacobian == nullptr) return;
    std::array<double, 5> by;
    for (std::size_t k = 0; k < 5; ++k) by[k] = factor * felt[i].part[k][2];
    AddChain(by, lane.placed[i], vehicle_.wheels[i], l, (*jacobian)[row].data());
  };
  for (std::size_t i = 0; i < wheels(); ++i) {
    if (l.rim[i] < 0) continue;
    const auto row = static_cast<std::size_t>(l.rim[i]);
    const int drive = vehicle_.wheels[i].drive;
    const std::size_t first = drive < 0 ? i : first_[static_cast<std::size_t>(drive)];
    Column* slope = jacobian != nullptr ? &(*jacobian)[row] : nullptr;
    (*residual)[row] = 0;
    if (slope != nullptr) std::fill_n(slope->begin(), l.size, 0.0);
    if (drive < 0 || first != i) {
      add(i, per, row);
      if (drive >= 0) add(first, -per, row);
      for (std::size_t k = 0; slope != nullptr && k < l.size; ++k) (*slope)[k] *= lane.unit[k];
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

void Mechanics::Write(const Lane& lane, std::span<const Felt> felt, bool brief) const noexcept {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  Solution& s = *lane.solution;
  const Twist t = TwistOf(lane);
  const double scale = lane.scale;
  s.v_x_m_per_s = t.v_x * scale;
  s.v_y_m_per_s = t.v_y * scale;
  s.yaw_rate_rad_per_s = t.yaw * scale;
  s.side_slip_rad =
      brief ? kNaN
            : std::atan2(t.v_y + t.yaw * vehicle_.centre_x_m, t.v_x - t.yaw * vehicle_.centre_y_m);
  s.steering_rad = t.psi;
  s.evaluations = lane.evaluations;
  s.tip_margin = lane.tip_margin;
  s.reasons = 0;
  s.shaft_power_w = 0;
  Four sum{};
  double deepest = 0;
  std::uint32_t flags = 0;
  for (std::size_t i = 0; i < wheels(); ++i) {
    const Placed& p = lane.placed[i];
    const Felt& f = felt[i];
    WheelSolution& w = s.wheel[i];
    w.load_n = p.load;
    w.rim_speed_m_per_s = p.rim * scale;
    w.v_x_m_per_s = p.v_x * scale;
    w.v_y_m_per_s = p.v_y * scale;
    w.f_x_n = f.f_x();
    w.f_y_n = f.f_y();
    w.torque_n_m = f.torque();
    w.m_z_n_m = f.m_z();
    w.sinkage_m = f.sinkage;
    w.shaft_power_w = f.torque() * p.rim * scale / radius(i);
    w.flags = f.flags;
    w.slip = w.slip_angle_rad = w.steer_rad = kNaN;
    if (!brief) {
      const surrogate::SlipState slip = surrogate::ToSlip(p.v_x, p.v_y, p.rim);
      w.slip = slip.slip;
      w.slip_angle_rad = slip.attack_angle_rad;
      w.steer_rad = std::atan2(p.sin, p.cos);
    }
    Four rows;
    Turn(p, vehicle_.wheels[i], radius(i) - f.sinkage).To(f.part[0], &rows);
    sum += rows;
    s.shaft_power_w += w.shaft_power_w;
    deepest = std::max(deepest, f.sinkage / radius(i));
    flags |= f.flags;
  }
  s.f_x_n = sum[0];
  s.f_y_n = sum[1];
  s.m_z_n_m = sum[2];
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
