#pragma once

#include <string>

#include "grouser/v1alpha1/explanation.pb.h"

namespace grouser::surrogate {

/// An explanation for people: the answer with the parts of its interval, flags with their reasons,
/// the training domain, runs with what DEM and model say there, notes.
std::string ExplanationText(const v1alpha1::Explanation& explanation);

}  // namespace grouser::surrogate
