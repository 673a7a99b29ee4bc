#include "surrogate/models/kinematics.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kRounding = 1e-9;  // slack at the edges of what is possible

double Larger(double a, double b) { return a > b ? a : b; }

}  // namespace

SlipState ToSlip(double v_x, double v_y, double rim_speed) noexcept {
  const double hub = std::hypot(v_x, v_y);
  const double speed = Larger(std::fabs(rim_speed), hub);
  if (speed == 0) return {0, 0, true};
  // + 0.0 turns -0 into 0, so that a state has one angle.
  const double angle = hub == 0 ? 0 : std::atan2(v_y + 0.0, v_x + 0.0);
  return {rim_speed / speed - v_x / speed, angle, false};
}

SlipRange SlipsAt(double attack_angle_rad) noexcept {
  const double c = std::cos(attack_angle_rad);
  return {-1 - Larger(c, 0), 1 + Larger(-c, 0)};
}

VelocityState FromSlip(double slip, double attack_angle_rad, double speed) noexcept {
  const SlipRange range = SlipsAt(attack_angle_rad);
  if (!(slip >= range.low - kRounding) || !(slip <= range.high + kRounding) || !(speed > 0) ||
      !std::isfinite(speed) || !(std::fabs(attack_angle_rad) <= std::numbers::pi + kRounding)) {
    return {kNaN, kNaN, kNaN};
  }
  double c = std::cos(attack_angle_rad);
  if (std::fabs(c) < 1e-15) c = 0;  // pi/2 has no exact double
  const double s = std::sin(attack_angle_rad);
  const double rim = slip + c;
  if (std::fabs(rim) <= 1 + kRounding) {  // the hub is the faster
    const double bounded = rim > 1 ? 1 : rim < -1 ? -1 : rim;
    return {c * speed, s * speed, bounded * speed};
  }
  // The rim is the faster: |rim| = speed, in the sense of travel.
  const double sense = rim > 0 ? 1 : -1;
  const double v_x = sense - slip;
  const double bounded = sense * v_x < 0 ? 0 : v_x;
  return {bounded * speed, bounded * s / c * speed, sense * speed};
}

Canonical ToCanonical(double v_x, double v_y, double rim_speed) noexcept {
  const double speed = Larger(std::fabs(rim_speed), std::hypot(v_x, v_y));
  const bool backward = v_x < 0 || (v_x == 0 && rim_speed < 0);
  const double mirror = backward ? -1 : 1;
  Canonical c;
  c.forward = mirror * v_x / speed;
  c.lateral = std::fabs(v_y) / speed;
  c.rim = mirror * rim_speed / speed;
  c.speed = speed;
  c.sign_x = v_x == 0 && rim_speed == 0 ? 0 : mirror;
  c.sign_y = v_y == 0 ? 0 : v_y < 0 ? -1 : 1;
  return c;
}

ChartPoint ToChart(const Canonical& state) noexcept {
  const double in_plane = std::sqrt(state.forward * state.forward + state.rim * state.rim);
  return {in_plane == 0 ? 0 : std::atan2(state.rim, state.forward),
          std::atan2(state.lateral, in_plane)};
}

}  // namespace grouser::surrogate
