#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "grouser/contact.h"

/// For simulators whose tyres are classes of their own, as Chrono's (grouser/chrono.h): one wheel
/// that is asked by the time, and its force as it stands in the contact patch. Needs no simulator.
namespace grouser {

/// A wheel on a model's soil that keeps what it remembers (ContactState) by itself. The model
/// outlives it.
class TimedWheel {
 public:
  /// Throws as WheelContact.
  explicit TimedWheel(const Model& model, const ContactOptions& options = {})
      : contact_(model, options) {}

  /// The force at `time` [s]. motion.time_step is not read: it is the time since the last call at
  /// an earlier one, 0 at the first. Again at the same time: that step anew, from where it began,
  /// with this motion. Where the time goes back the wheel remembers nothing.
  const WheelForce& At(double time, WheelMotion motion) {
    if (!(time == time_)) {
      step_ = time > time_ ? time - time_ : 0;
      before_ = time > time_ ? state_ : ContactState{};
      time_ = time;
    }
    motion.time_step = step_;
    state_ = before_;
    force_ = contact_.Evaluate(motion, &state_);
    return force_;
  }

  const WheelForce& force() const { return force_; }  ///< of the last call
  const WheelContact& contact() const { return contact_; }

 private:
  WheelContact contact_;
  double time_ = std::numeric_limits<double>::infinity(), step_ = 0;
  ContactState before_, state_;
  WheelForce force_;
};

/// The force on a wheel in the frame of its contact patch: origin P on the ground's plane, under
/// the wheel's centre along the normal; axes x = axle cross n, y = n cross x, n, as of
/// WheelContact.
struct ContactPatch {
  std::array<double, 3> point{};        ///< P, world axes [m]
  std::array<double, 3> x{}, y{}, n{};  ///< unit vectors, world axes
  std::array<double, 4> rotation{};     ///< from the patch's axes to the world's: w, x, y, z
  std::array<double, 3> velocity{};     ///< of the wheel's centre, in (x, y, n) [m/s]
  std::array<double, 3> force{};        ///< in (x, y, n) [N]
  std::array<double, 3> moment{};       ///< about P, in (x, y, n) [N m]
};

namespace timed_wheel {

using Vector = std::array<double, 3>;
inline double Dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vector Cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
/// a + s b.
inline Vector Plus(const Vector& a, double s, const Vector& b) {
  return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
}
inline Vector Unit(const Vector& a) {
  const double length = std::sqrt(Dot(a, a));
  return {a[0] / length, a[1] / length, a[2] / length};
}

/// Of the rotation whose matrix has the columns x, y, z (w, x, y, z): from the largest of its four
/// numbers, so that nothing is divided by a small one.
inline std::array<double, 4> Quaternion(const Vector& x, const Vector& y, const Vector& z) {
  const std::array<double, 4> square = {1 + x[0] + y[1] + z[2], 1 + x[0] - y[1] - z[2],
                                        1 - x[0] + y[1] - z[2], 1 - x[0] - y[1] + z[2]};
  std::size_t most = 0;
  for (std::size_t i = 1; i < 4; ++i) most = square[i] > square[most] ? i : most;
  const double s = 2 * std::sqrt(square[most]), q = s / 4;
  switch (most) {
    case 0:
      return {q, (y[2] - z[1]) / s, (z[0] - x[2]) / s, (x[1] - y[0]) / s};
    case 1:
      return {(y[2] - z[1]) / s, q, (y[0] + x[1]) / s, (z[0] + x[2]) / s};
    case 2:
      return {(z[0] - x[2]) / s, (y[0] + x[1]) / s, q, (z[1] + y[2]) / s};
    default:
      return {(x[1] - y[0]) / s, (z[0] + x[2]) / s, (z[1] + y[2]) / s, q};
  }
}

}  // namespace timed_wheel

/// NaN where axle and normal are parallel.
inline ContactPatch PatchOf(const WheelMotion& wheel, const WheelForce& force) {
  using namespace timed_wheel;
  ContactPatch patch;
  patch.n = Unit(wheel.ground_normal);
  patch.x = Unit(Cross(wheel.axle, patch.n));
  patch.y = Cross(patch.n, patch.x);
  patch.rotation = Quaternion(patch.x, patch.y, patch.n);
  const double height = Dot(Plus(wheel.centre, -1, wheel.ground_point), patch.n);
  patch.point = Plus(wheel.centre, -height, patch.n);
  const Vector moment = Plus(force.moment, height, Cross(patch.n, force.force));
  const auto in_patch = [&](const Vector& v) -> Vector {
    return {Dot(v, patch.x), Dot(v, patch.y), Dot(v, patch.n)};
  };
  patch.velocity = in_patch(wheel.velocity);
  patch.force = in_patch(force.force);
  patch.moment = in_patch(moment);
  return patch;
}

}  // namespace grouser
