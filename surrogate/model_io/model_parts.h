#pragma once

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/hull.h"
#include "surrogate/models/residual_table.h"

namespace grouser::surrogate {

/// Parts of the model of a soil that its evaluator is made of, for who explains its answers. They
/// throw as MakeModel.

/// Training domain and uncertainty.
Hull TrainedHull(const v1alpha1::Model& model);
/// The residual's table with the hull distance; no table: all 0.
ResidualTable TrainedTable(const v1alpha1::Model& model);
/// Not present where no run was at another speed.
SpeedAxis TrainedSpeeds(const v1alpha1::Model& model);

}  // namespace grouser::surrogate
