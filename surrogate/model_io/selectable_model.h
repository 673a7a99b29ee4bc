#pragma once

#include <string>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/accuracy_request.h"

namespace grouser::surrogate {

/// Fewest runs behind a row of an error table that count as a measurement of the
/// error; a region with fewer is measured by the row of all regions.
inline constexpr unsigned kEnoughRuns = 10;

/// A model as a model of a model selector: its hull, its cost as measured here and now
/// (MeasureCost), and its error table: the rows "held_out" if enough runs were
/// held out, else "leave_one_out", else none. An rmse becomes a share by the rms
/// load of the runs behind it (by the middle load where they are not in the file).
/// `model` must outlive the model.
SelectableModel MakeSelectableModel(const v1alpha1::Model& message, const WheelModel& model);

/// Equal for models that may answer for each other: wheel and soil alike in
/// everything but what people call the wheel and where numbers came from (hard ground:
/// in its parameters), and intervals of one level.
std::string PairKey(const v1alpha1::Model& message);

}  // namespace grouser::surrogate
