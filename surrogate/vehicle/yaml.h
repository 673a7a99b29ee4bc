#pragma once

#if __has_include("proto/records/yaml/yaml_section.h")
#include "proto/records/yaml/yaml_section.h"
#else
#include "dem_offline/scenes/yaml_section.h"
namespace grouser {
namespace records = campaign;
}
#endif

/// The strict reader of people's YAML, under this folder's name for it.
namespace grouser::vehicle::yaml {
using records::InputError, records::kNonNegative, records::kPositive, records::NearestOf, records::ReadYamlText,
    records::Range, records::YamlSection;
}  // namespace grouser::vehicle::yaml
