#pragma once

#include <optional>
#include <string>
#include <vector>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/fit/json.h"
#include "surrogate/soils/cone_table.h"

namespace grouser::surrogate {

/// SHA-256 of all that a soil of grains is: of its values a line "PATH=VALUE\n" each, sorted,
/// numbers to 9 digits; without name, source and zeros. The same in Python: identity_of
/// (dem_offline/bevameter/grain_soil.py).
std::string SoilIdentity(const v1alpha1::Soil& soil);

/// The cone index of the soil that a model's runs had: by SoilIdentity; of a model without grains
/// (untuned, from a bevameter's soil.csv) by the soil's name. None of hard ground.
std::optional<ConeIndex> ConeOf(const v1alpha1::Model& model, const std::vector<ConeIndex>& cones);

/// For a model's card: ConeText, or where to get one.
std::string ConeCardText(const std::optional<ConeIndex>& cone);
/// An object, or null.
Json ConeCardJson(const std::optional<ConeIndex>& cone);

}  // namespace grouser::surrogate
