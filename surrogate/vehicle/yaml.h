#pragma once

#include "dem_offline/scenes/yaml_section.h"

/// The strict reader of people's YAML, under this folder's name for it.
namespace grouser::vehicle::yaml {
using campaign::InputError, campaign::kNonNegative, campaign::kPositive, campaign::NearestOf,
    campaign::Range, campaign::YamlSection;
}  // namespace grouser::vehicle::yaml
