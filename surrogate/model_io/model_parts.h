#pragma once

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/bekker.h"
#include "surrogate/models/hull.h"

namespace grouser::surrogate {

/// Parts of the model of a soil that its evaluator is made of, for who explains its answers. They
/// throw as MakeModel.

/// Training domain and uncertainty.
Hull TrainedHull(const v1alpha1::Model& model);
/// The hull distance by the residual's table, at a moving state; no table: 0. Copies no table.
double TrainedDistance(const v1alpha1::Model& model, const Canonical& state, double load);
/// q of HybridModel; 0 where the table is added to the physics.
double TrainedShare(const v1alpha1::Model& model, const Canonical& state, double load);
/// Precondition: a model with physics of a soil.
BekkerModel TrainedPhysics(const v1alpha1::Model& model);
/// Not present where no run was at another speed.
SpeedAxis TrainedSpeeds(const v1alpha1::Model& model);

}  // namespace grouser::surrogate
