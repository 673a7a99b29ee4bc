#include "server/core/accuracy_request.h"

#include <fmt/format.h>

#include <cmath>

#include "surrogate/models/kinematics.h"

namespace grouser::server {

Status ReadAccuracyRequest(const v1alpha1::AccuracyRequest& message,
                           surrogate::AccuracyRequest* accuracy) {
  *accuracy = {};
  surrogate::AccuracyRequest read;
  const struct {
    const char* field;
    double value;
    double* to;
    double factor;
  } fields[] = {
      {"f_x_n", message.f_x_n(), &read.tolerance[surrogate::kFx], 1},
      {"f_y_n", message.f_y_n(), &read.tolerance[surrogate::kFy], 1},
      {"f_z_n", message.f_z_n(), &read.tolerance[surrogate::kFz], 1},
      {"torque_n_m", message.torque_n_m(), &read.tolerance[surrogate::kTorque], 1},
      {"m_z_n_m", message.m_z_n_m(), &read.tolerance[surrogate::kMz], 1},
      {"sinkage_m", message.sinkage_m(), &read.tolerance[surrogate::kSinkage], 1},
      {"share_of_load", message.share_of_load(), &read.share_of_load, 1},
      {"budget_us", message.budget_us(), &read.budget_ns, 1e3},
  };
  for (const auto& f : fields) {
    *f.to = f.factor * f.value;
    // The product, too: 1e306 us are no finite number of nanoseconds.
    if (f.value >= 0 && std::isfinite(*f.to)) continue;
    return Status::InvalidArgument(fmt::format(
        "accuracy.{}: {}, expected a finite number above 0, or 0 for none", f.field, f.value));
  }
  if (!v1alpha1::IntervalTarget_IsValid(message.interval_target())) {
    return Status::InvalidArgument(
        fmt::format("accuracy.interval_target: {}, expected one of INTERVAL_TARGET_DEM and "
                    "INTERVAL_TARGET_MEASURED",
                    static_cast<int>(message.interval_target())));
  }
  if (message.interval_target() == v1alpha1::INTERVAL_TARGET_MEASURED) {
    if (!read.HasTolerance()) {
      return Status::InvalidArgument(
          "accuracy.interval_target: INTERVAL_TARGET_MEASURED without a tolerance, expected one: "
          "share_of_load or that of an output");
    }
    read.target = surrogate::IntervalTarget::kMeasured;
  }
  *accuracy = read;
  return Status::Ok();
}

v1alpha1::TestState ToTestState(double v_x, double v_y, double rim_speed, double load) {
  const surrogate::Canonical state = surrogate::ToCanonical(v_x, v_y, rim_speed);
  v1alpha1::TestState test;
  test.set_mode(v1alpha1::RIG_MODE_RIM_SPEED);
  test.set_slip(state.rim - state.forward);
  test.set_attack_angle_rad(std::atan2(state.lateral, state.forward));
  test.set_load_n(load);
  return test;
}

}  // namespace grouser::server
