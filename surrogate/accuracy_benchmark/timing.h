#pragma once

#include <array>
#include <functional>
#include <vector>

#include "surrogate/fit/training_set.h"
#include "surrogate/models/wheel_model.h"

// What an answer costs, measured on this core.

namespace grouser::surrogate {

struct Answer {
  std::array<double, kOutputs> value, half_width;
};

/// Median processor time of a call that answers n states, over so many seconds and at least
/// three calls [ns a state].
double TimeOf(const std::function<void()>& call, double n, double seconds);
/// The same of a model, all outputs with intervals, in batches of 10,000 drawn
/// from `states`.
double TimeOfModel(const WheelModel& model, const std::vector<Sample>& states, double seconds);

}  // namespace grouser::surrogate
