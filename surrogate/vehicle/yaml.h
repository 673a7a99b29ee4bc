#pragma once

#if __has_include("proto/records/yaml/yaml_section.h")
#include "proto/records/yaml/yaml_section.h"
namespace grouser::vehicle::yaml {
namespace reader = records;
}
#else
#include "dem_offline/scenes/yaml_section.h"
namespace grouser::vehicle::yaml {
namespace reader = campaign;
}
#endif

/// The strict reader of people's YAML, under this folder's name for it.
namespace grouser::vehicle::yaml {
using reader::InputError, reader::kNonNegative, reader::kPositive, reader::NearestOf, reader::Range,
    reader::ReadYamlText, reader::YamlSection;
}  // namespace grouser::vehicle::yaml
