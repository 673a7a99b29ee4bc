#pragma once

#include <array>
#include <memory>
#include <vector>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/hard_ground.h"
#include "surrogate/models/hybrid.h"

namespace grouser::surrogate {

/// The way from parts to message, for the fitter; MakeModel is its inverse.

/// Padded coefficients per channel, see ResidualTable; an empty one is 0.
using TableCoefficients = std::array<std::vector<double>, ResidualTable::kChannels>;

void SetBekker(const BekkerParameters& parameters, v1alpha1::Model* model);
void SetHard(const HardGround& ground, v1alpha1::Model* model);
void SetResidual(const TableAxes& axes, const TableCoefficients& coefficients,
                 v1alpha1::Model* model);
/// The speed axis: coefficients per unit of Froude number on the axes of SetResidual,
/// which comes first (it clears them).
void SetSpeed(const SpeedAxis& speed, const TableCoefficients& rates, v1alpha1::Model* model);
/// Evaluates the model at 24 states over its domain and stores the answers as
/// golden vectors, replacing older ones. Where a wheel would sink beyond 0.5 r, where
/// tables are coarser than TabulatedModel::Tolerance, its load is halved, ten times at most.
/// Throws as MakeModel.
void SetGoldenVectors(v1alpha1::Model* model);

/// Throws std::invalid_argument naming the parameter that is missing, or saying that one is
/// unknown.
BekkerParameters ReadBekker(const v1alpha1::BekkerParameters& message);
HardGround ReadHard(const v1alpha1::HardGround& message);

/// The evaluator without its self-test. Throws as MakeModel; MakeHybrid also for
/// a model without physics of a soil.
HybridModel MakeHybrid(const v1alpha1::Model& model);
/// That of any model of a soil; a hybrid or Bekker one answers by its exact law, untabulated.
/// Throws also for hard ground.
std::unique_ptr<TabulatedModel> MakeScalar(const v1alpha1::Model& model);
/// That of any model.
std::unique_ptr<const WheelModel> MakeLaw(const v1alpha1::Model& model);

}  // namespace grouser::surrogate
