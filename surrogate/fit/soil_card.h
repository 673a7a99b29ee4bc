#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/fit/json.h"
#include "surrogate/soils/bevameter_table.h"
#include "surrogate/soils/cone_table.h"
#include "surrogate/soils/grain_table.h"

namespace grouser::surrogate {

/// SHA-256 of all that a soil of grains is: of its values a line "PATH=VALUE\n" each, sorted,
/// numbers to 9 digits; without name, source and zeros. The same in Python: identity_of
/// (dem_offline/bevameter/grain_soil.py).
std::string SoilIdentity(const v1alpha1::Soil& soil);

/// The line of the soil that a model's runs had: by SoilIdentity; of a model without grains
/// (untuned, from a bevameter's soil.csv) by the soil's name. None of hard ground.
template <typename Line>
std::optional<Line> LineOfSoil(const v1alpha1::Model& model, const std::vector<Line>& lines) {
  if (model.kind() == v1alpha1::MODEL_KIND_HARD) return std::nullopt;
  if (!model.soil().has_grains()) {
    const Line* named = FindByName(lines, model.soil().name());
    return named == nullptr ? std::nullopt : std::optional(*named);
  }
  const auto found = std::ranges::find(lines, SoilIdentity(model.soil()), &Line::soil_sha256);
  return found == lines.end() ? std::nullopt : std::optional(*found);
}

/// What a model's card says of its soil, whatever the wheel.
struct SoilCard {
  std::optional<BevameterSoil> bevameter;
  std::optional<ConeIndex> cone;
};
/// Of the shipped tables and of these files. Throws as BevameterSoils and ConeIndices.
SoilCard SoilCardOf(const v1alpha1::Model& model, const std::vector<std::string>& bevameters,
                    const std::vector<std::string>& cones);

/// What is known, or where to get it.
std::string SoilCardText(const SoilCard& card);
/// {"bevameter": {} or null, "cone_index": {} or null}.
Json SoilCardJson(const SoilCard& card);

}  // namespace grouser::surrogate
