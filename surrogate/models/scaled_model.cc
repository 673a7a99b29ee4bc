#include "surrogate/models/scaled_model.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace grouser::surrogate {
namespace {

constexpr std::size_t kBlock = 128;  // states at a time
using Numbers = std::array<double, kBlock>;

bool Positive(double x) { return x > 0 && std::isfinite(x); }

std::span<const double> Divided(std::span<const double> from, double by, Numbers* to) noexcept {
  for (std::size_t i = 0; i < from.size(); ++i) (*to)[i] = from[i] / by;
  return {to->data(), from.size()};
}

void Multiply(std::span<double> values, double by) noexcept {
  for (double& x : values) x *= by;
}

}  // namespace

double Similarity::Speed() const noexcept { return std::sqrt(gravity * length); }
double Similarity::YawRate() const noexcept { return std::sqrt(gravity / length); }

TrainingDomain Scaled(TrainingDomain box, const Similarity& by) noexcept {
  box.load_min_n *= by.Force();
  box.load_max_n *= by.Force();
  box.gravity_m_per_s2 *= by.gravity;
  return box;
}

FormErrors Scaled(FormErrors form, const Similarity& by) noexcept {
  form.middle_load_n *= by.Force();
  for (FormErrors::OfRegion& region : form.region) {
    for (int o = 0; o < kOutputs; ++o) region.sd[o] *= by.Of(o);
  }
  return form;
}

ScaledModel::ScaledModel(std::shared_ptr<const WheelModel> model, double radius_m,
                         const Similarity& by, bool widened)
    : model_(std::move(model)), by_(by), radius_m_(radius_m * by.length) {
  // A force of 0 or infinity is a ratio that doubles do not hold.
  if (!model_ || !Positive(radius_m) || !Positive(by.length) || !Positive(by.gravity) ||
      !Positive(by.Force()) || !Positive(by.Moment()) || !Positive(by.Speed())) {
    throw std::invalid_argument("similar wheel: lengths x " + std::to_string(by.length) +
                                ", gravity x " + std::to_string(by.gravity) +
                                ", expected a model, and positive finite numbers");
  }
  const double doublings = std::log2(by.gravity * by.length);
  const auto& sd = doublings > 0 ? kSdPerDoubling : kSdPerHalving;
  for (int o = 0; o < kOutputs; ++o) {
    sd_[o] = widened && !by.IsIdentity() ? sd[o] * std::fabs(doublings) : 0;
    widens_ |= sd_[o] > 0;
  }
}

void ScaledModel::Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept {
  const double speed = by_.Speed(), yaw_rate = by_.YawRate(), force = by_.Force();
  Numbers v_x, v_y, rim, load, yaw;
  std::array<std::array<Numbers, 2>, kOutputs> room;  // what was not asked for, to widen the rest
  for (std::size_t first = 0; first < in.load.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, in.load.size() - first);
    const WheelStatesView asked = Cut(in, first, count);
    WheelStatesView mapped = asked;
    mapped.v_x = Divided(asked.v_x, speed, &v_x);
    mapped.v_y = Divided(asked.v_y, speed, &v_y);
    mapped.rim_speed = Divided(asked.rim_speed, speed, &rim);
    mapped.load = Divided(asked.load, force, &load);
    mapped.yaw_rate = Divided(asked.yaw_rate, yaw_rate, &yaw);
    ResponsesView answers = Cut(out, first, count);
    for (int o = 0; widens_ && o < kOutputs; ++o) {
      OutputView& view = answers.output[o];
      if (view.low.empty() == view.high.empty()) continue;
      if (view.low.empty()) view.low = {room[o][0].data(), count};
      if (view.high.empty()) view.high = {room[o][1].data(), count};
    }
    model_->Evaluate(mapped, answers);
    MapBack(answers);
    if (widens_) Widen(asked, answers);
  }
}

void ScaledModel::MapBack(const ResponsesView& out) const noexcept {
  for (int o = 0; o < kOutputs; ++o) {
    const OutputView& view = out.output[o];
    const double unit = by_.Of(o);
    for (const std::span<double>& of :
         {view.value, view.sd_fit, view.sd_patch, view.low, view.high})
      Multiply(of, unit);
    for (const std::span<double>& of : {view.d_v_x, view.d_v_y, view.d_rim_speed})
      Multiply(of, unit / by_.Speed());
    Multiply(view.d_load, unit / by_.Force());
  }
}

void ScaledModel::Widen(const WheelStatesView& in, const ResponsesView& out) const noexcept {
  for (int o = 0; o < kOutputs; ++o) {
    const OutputView& view = out.output[o];
    if (sd_[o] == 0 || (view.sd_fit.empty() && view.low.empty())) continue;
    for (std::size_t i = 0; i < in.load.size(); ++i) {
      if ((out.flags[i] & (kInvalid | kAirborne)) != 0) continue;
      const double sd = sd_[o] * OutputScale(o, in.load[i], radius_m_);
      if (!view.sd_fit.empty()) view.sd_fit[i] = std::hypot(view.sd_fit[i], sd);
      if (view.low.empty()) continue;
      const double middle = 0.5 * (view.low[i] + view.high[i]);
      const double half = std::hypot(0.5 * (view.high[i] - view.low[i]), kTwoSided90 * sd);
      view.low[i] = middle - half;
      view.high[i] = middle + half;
    }
  }
}

}  // namespace grouser::surrogate
