#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "grouser/model.h"

/// A model as a vehicle-terrain interaction of MAVS (grouser/mavs.h) asks it: by load, slip and
/// slip angle, answered by ratios. Needs no simulator.
namespace grouser {

/// Over the load but for the sinkage; NaN where flags has kInvalid.
struct VtiAnswer {
  double traction;    ///< gross: torque over radius [-]
  double resistance;  ///< gross less pull [-]
  double pull;        ///< drawbar pull, net [-]
  double lateral;     ///< against the lateral motion; of the slip angle's sign [-]
  double sinkage;     ///< [m]
  std::uint32_t flags;
};

/// The wheel state of MAVS' slip and of a slip angle at `speed` = max(|r w|, V) [m/s]. Slip in -1
/// to 1 is
///   1 - v_x/(r w) where r w >= v_x,   (r w)/v_x - 1 where the hub is the faster,
/// of the speed v_x along the wheel alone; slip angle is atan(v_y/|v_x|), within +-pi/2. A wheel
/// that drives backwards has the slip of one that brakes forwards, and is taken for that. NaN for a
/// slip or an angle that is not finite. MavsTire's own slip angle is not this one: docs/hosts.md.
inline State StateOfVti(double slip, double angle, double load, double speed) {
  if (!std::isfinite(slip) || !std::isfinite(angle)) {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    return {kNaN, kNaN, kNaN, load};
  }
  slip = std::clamp(slip, -1.0, 1.0);
  const double along = slip >= 0 ? 1 - slip : 1, rim = slip >= 0 ? 1 : 1 + slip;
  // A wheel that moves sideways alone has no along; its sine keeps what its tangent cannot.
  const double c = std::max(0.0, std::cos(angle)), s = std::sin(angle);
  const double v_x = along * c, v_y = along * s, r_w = rim * c;
  const double most = std::max(std::abs(r_w), std::hypot(v_x, v_y));
  if (!(most > 0)) return {0, 0, speed, load};  // spins on the spot
  return {speed * v_x / most, speed * v_y / most, speed * r_w / most, load};
}

/// At the speed of the training runs: MAVS tells none.
inline VtiAnswer AskVti(const Model& model, double slip, double angle, double load) {
  const State state = StateOfVti(slip, angle, load, model.domain().speed_m_per_s);
  const Answer answer = model.Evaluate(state);
  const auto ratio = [&](Output output) { return answer.output[output].value / load; };
  VtiAnswer out{};
  out.flags = answer.flags;
  if (load == 0 && (out.flags & kInvalid) == 0) return out;  // airborne: zeros
  out.traction = ratio(kTorque) / model.radius_m();
  out.pull = ratio(kFx);
  out.resistance = out.traction - out.pull;
  out.lateral = -ratio(kFy);
  out.sinkage = answer.output[kSinkage].value;
  return out;
}

}  // namespace grouser
