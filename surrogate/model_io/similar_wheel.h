#pragma once

#include <memory>
#include <string>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/scaled_model.h"

namespace grouser::surrogate {

/// Why a model says nothing of similar wheels; empty: it does. A soil that coheres has one more
/// pressure, and so another ratio that a size or a gravity changes: grains with a cohesive law or a
/// surface energy, or, of an untuned model, a soil with c, k_c or k_c' above 0. (The cohesion of a
/// fit to dry grains is a number of the fit.)
std::string ScalingRefusal(const v1alpha1::Model& model);

/// What takes the model's wheel to one of this radius [m] under this gravity [m/s^2]. Throws
/// std::invalid_argument "model NAME: ..." where ScalingRefusal says why, and for numbers that are
/// not positive and finite.
Similarity SimilarityTo(const v1alpha1::Model& model, double radius_m, double gravity_m_per_s2);

/// `evaluator` (of `model`) for the similar wheel.
std::unique_ptr<const WheelModel> MakeScaled(const v1alpha1::Model& model,
                                             std::shared_ptr<const WheelModel> evaluator,
                                             const Similarity& by);

}  // namespace grouser::surrogate
