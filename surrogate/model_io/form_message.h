#pragma once

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/form_error.h"

namespace grouser::surrogate {

/// DEM minus measurement as a model file has it: form_by_region, or where there is none sd_form in
/// all regions and at all loads, without a factor. Throws std::runtime_error "model NAME:
/// form_by_region[...]: ..." for a region that is unknown or comes twice, arrays that are not six,
/// and numbers that are negative or infinite.
FormErrors FormErrorsOf(const v1alpha1::Model& message);

/// The message's region of one of ours.
v1alpha1::MeasuredRegion ToMessage(MeasuredRegion region);

}  // namespace grouser::surrogate
