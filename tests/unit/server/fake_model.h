#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::testing {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// An analytic model whose answers a test can work out by hand:
/// f_x = gain load slip, f_y = -gain load sin(beta), f_z = load,
/// torque = r f_x, m_z = 0, sinkage = 1e-3 load; sd_fit 1, sd_patch 2,
/// interval value +- half (3).
class FakeModel final : public surrogate::WheelModel {
 public:
  FakeModel(double gain, double radius_m, double half = 3)
      : gain_(gain), radius_m_(radius_m), half_(half) {}

  void Evaluate(const surrogate::WheelStatesView& in,
                const surrogate::ResponsesView& out) const noexcept override {
    for (std::size_t i = 0; i < in.v_x.size(); ++i) {
      const auto s = surrogate::ToSlip(in.v_x[i], in.v_y[i], in.rim_speed[i]);
      const double load = in.load[i];
      const bool valid = std::isfinite(in.v_x[i]) && std::isfinite(in.v_y[i]) &&
                         std::isfinite(in.rim_speed[i]) && std::isfinite(load) && load >= 0;
      out.flags[i] = !valid ? surrogate::kInvalid : s.is_static ? surrogate::kStatic : 0u;
      const double nan = std::numeric_limits<double>::quiet_NaN();
      const double f_x = gain_ * load * s.slip;
      const double values[] = {f_x,  -gain_ * load * std::sin(s.attack_angle_rad),
                               load, radius_m_ * f_x,
                               0.0,  1e-3 * load};
      for (int k = 0; k < surrogate::kOutputs; ++k) {
        const auto& to = out.output[k];
        const double value = valid ? values[k] : nan;
        if (!to.value.empty()) to.value[i] = value;
        if (!to.sd_fit.empty()) to.sd_fit[i] = valid ? 1.0 : nan;
        if (!to.sd_patch.empty()) to.sd_patch[i] = valid ? 2.0 : nan;
        if (!to.low.empty()) to.low[i] = value - half_;
        if (!to.high.empty()) to.high[i] = value + half_;
      }
      if (!out.slip.empty()) out.slip[i] = valid ? s.slip : nan;
      if (!out.attack_angle.empty()) out.attack_angle[i] = valid ? s.attack_angle_rad : nan;
      if (valid && load == 0) surrogate::WriteAirborne(out, i);
    }
  }

 private:
  double gain_, radius_m_, half_;
};

/// A model message for FakeModel with one golden vector.
inline v1alpha1::Model FakeMessage(const std::string& name, double gain) {
  constexpr double kRadius = 0.0625;
  v1alpha1::Model message;
  message.set_name(name);
  message.mutable_wheel()->set_radius_m(kRadius);
  message.mutable_domain()->set_speed_m_per_s(0.1);
  message.set_interval_level(0.9);
  message.set_averaging_length_m(0.3);
  message.mutable_bekker()->set_n(gain);  // FakeModel has it for its gain
  auto* golden = message.add_golden();
  golden->set_v_x_m_per_s(0.05);
  golden->set_rim_speed_m_per_s(0.1);
  golden->set_load_n(24);
  const double f_x = gain * 24 * 0.5;
  for (const double value : {f_x, 0.0, 24.0, kRadius * f_x, 0.0, 0.024}) golden->add_value(value);
  return message;
}

/// DEM minus measurement of driving wheels, straight: f_x 2 at 24 N, factor 2; and, if `all`, of
/// everything else there, 0.5 and factor 2.
inline void AddStraightForm(bool all, v1alpha1::Model* message) {
  message->mutable_domain()->set_load_min_n(12);
  message->mutable_domain()->set_load_max_n(48);
  v1alpha1::FormError* form = message->add_form_by_region();
  form->set_region(v1alpha1::MEASURED_REGION_STRAIGHT);
  for (int k = 0; k < surrogate::kOutputs; ++k) {
    form->add_rows(k == 0 || all ? 3 : 0);
    form->add_sd(k == 0 ? 2 : all ? 0.5 : kNan);
    form->add_factor(k == 0 || all ? 2 : kNan);
  }
}

/// ModelFactory of FakeMessage(): gain n, half c1 if it is there; refuses a gain of 0.
inline std::unique_ptr<const surrogate::WheelModel> MakeFakeModel(
    const v1alpha1::Model& message, const surrogate::KeptTable& = {}) {
  const double gain = message.bekker().n();
  if (gain == 0) throw std::runtime_error("bekker.gain: 0, expected another number");
  return std::make_unique<FakeModel>(gain, message.wheel().radius_m(),
                                     message.bekker().has_c1() ? message.bekker().c1() : 3);
}

}  // namespace grouser::testing
