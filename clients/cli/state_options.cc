#include "clients/cli/state_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace grouser::cli {
namespace {

/// Values of one option, spread over n states; `fallback` when not given.
class Spread {
 public:
  Spread(const char* option, const std::vector<double>& values, double fallback, std::size_t n)
      : values_(values), fallback_(fallback) {
    if (values.size() > 1 && values.size() != n) {
      throw CLI::ValidationError(
          option,
          fmt::format("{} values, expected 1 or {} as in the longest list", values.size(), n));
    }
  }
  double operator[](std::size_t i) const {
    if (values_.empty()) return fallback_;
    return values_.size() == 1 ? values_.front() : values_[i];
  }

 private:
  const std::vector<double>& values_;
  double fallback_;
};

}  // namespace

void StateOptions::AddTo(CLI::App& command) {
  const auto add = [&command](const char* name, std::vector<double>* values, const char* text) {
    return command.add_option(name, *values, text)->group("State");
  };
  add("--slip", &slip_, "Slip [-]: (r w - v_x)/max(|r w|, V), -2 to 2");
  add("--angle-deg", &angle_deg_, "Attack angle [deg]: atan2(v_y, v_x), left positive");
  add("--speed", &speed_, "max(|r w|, V) [m/s]; default: the model's training speed");
  add("--vx", &v_x_, "Hub velocity forward [m/s]");
  add("--vy", &v_y_, "Hub velocity to the left [m/s]");
  add("--rim", &rim_, "Rim speed r w [m/s]");
  add("--load", &load_, "Vertical load [N]")->required();
}

v1alpha1::WheelStates StateOptions::Build() const {
  const bool by_slip = !slip_.empty() || !angle_deg_.empty() || !speed_.empty();
  const bool by_velocity = !v_x_.empty() || !v_y_.empty() || !rim_.empty();
  if (by_slip == by_velocity) {
    throw CLI::ValidationError("state",
                               "expected either --slip/--angle-deg/--speed or --vx/--vy/--rim");
  }
  const std::size_t n = std::max({slip_.size(), angle_deg_.size(), speed_.size(), v_x_.size(),
                                  v_y_.size(), rim_.size(), load_.size()});
  const Spread load("--load", load_, 0, n);
  v1alpha1::WheelStates states;
  for (std::size_t i = 0; i < n; ++i) states.add_load_n(load[i]);
  if (by_slip) {
    const Spread slip("--slip", slip_, 0, n);
    const Spread angle("--angle-deg", angle_deg_, 0, n);
    const Spread speed("--speed", speed_, 0, n);
    auto* form = states.mutable_slip();
    for (std::size_t i = 0; i < n; ++i) {
      form->add_slip(slip[i]);
      form->add_attack_angle_rad(angle[i] * kRadPerDeg);
      if (!speed_.empty()) form->add_speed_m_per_s(speed[i]);
    }
    return states;
  }
  const Spread v_x("--vx", v_x_, 0, n);
  const Spread v_y("--vy", v_y_, 0, n);
  const Spread rim("--rim", rim_, 0, n);
  auto* form = states.mutable_velocity();
  for (std::size_t i = 0; i < n; ++i) {
    form->add_v_x_m_per_s(v_x[i]);
    form->add_v_y_m_per_s(v_y[i]);
    form->add_rim_speed_m_per_s(rim[i]);
  }
  return states;
}

}  // namespace grouser::cli
