#include "surrogate/model_io/write_model.h"

#include <cmath>
#include <numbers>

namespace grouser::surrogate {

void SetResidual(const TableAxes& axes, const TableCoefficients& coefficients,
                 v1alpha1::Model* model) {
  constexpr double kPi = std::numbers::pi;
  v1alpha1::ResidualTable* table = model->mutable_residual();
  table->Clear();
  for (int i = 0; i <= axes.direction; ++i) {
    table->add_direction_knots_rad(-kPi / 2 + kPi * i / axes.direction);
  }
  for (int i = 0; i <= axes.lateral; ++i) {
    table->add_lateral_knots_rad(kPi / 2 * i / axes.lateral);
  }
  const double span = axes.log_load_max - axes.log_load_min;
  for (int i = 0; i <= axes.load; ++i) {
    // The last node exactly: it is read back as the end of the axis.
    table->add_log_load_knots(i == axes.load ? axes.log_load_max
                                             : axes.log_load_min + span * i / axes.load);
  }
  for (const std::vector<double>& channel : coefficients) {
    table->add_coefficients()->mutable_values()->Add(channel.begin(), channel.end());
  }
}

void SetSpeed(const SpeedAxis& speed, const TableCoefficients& rates, v1alpha1::Model* model) {
  v1alpha1::ResidualTable* table = model->mutable_residual();
  table->set_froude_reference(speed.reference);
  table->set_froude_max(speed.high);
  table->set_froude_saturation(speed.saturation);
  for (const std::vector<double>& channel : rates) {
    table->add_rate_coefficients()->mutable_values()->Add(channel.begin(), channel.end());
  }
}

void SetGoldenVectors(v1alpha1::Model* model) {
  constexpr double kGoldenSinkage = 0.5;  // of the radius
  model->clear_golden();
  const std::unique_ptr<const WheelModel> made = MakeLaw(*model);
  const v1alpha1::Domain& domain = model->domain();
  const double speed = domain.speed_m_per_s() > 0 ? domain.speed_m_per_s() : 0.1;
  constexpr std::array kSlips = {-1.0, -0.4, 0.0, 0.15, 0.5, 0.9};
  constexpr std::array kAngles = {0.0, -0.5, 1.0, std::numbers::pi / 2};
  int count = 0;
  for (const double slip : kSlips) {
    for (const double angle : kAngles) {
      const double mix = 0.25 * (count % 5);
      const double faster = model->residual().rate_coefficients().empty()
                                ? 1
                                : 1 + 0.3 * (count % 3 - 1);  // slower, as it is, faster
      ++count;
      const VelocityState v = FromSlip(slip, angle, faster * speed);
      const double most = kGoldenSinkage * model->wheel().radius_m();
      double load = domain.load_min_n() + mix * (domain.load_max_n() - domain.load_min_n());
      WheelAnswer answer = AnswerOf(*made, v, load);
      for (int halved = 0; halved < 10 && answer.value[kSinkage] > most; ++halved) {
        load /= 2;
        answer = AnswerOf(*made, v, load);
      }
      v1alpha1::GoldenVector* g = model->add_golden();
      g->set_v_x_m_per_s(v.v_x);
      g->set_v_y_m_per_s(v.v_y);
      g->set_rim_speed_m_per_s(v.rim_speed);
      g->set_load_n(load);
      g->mutable_value()->Add(answer.value.begin(), answer.value.end());
    }
  }
}

}  // namespace grouser::surrogate
