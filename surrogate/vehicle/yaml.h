#pragma once

#include "proto/records/yaml/yaml_section.h"

/// The strict reader of people's YAML, under this folder's name for it.
namespace grouser::vehicle::yaml {
using records::InputError, records::kNonNegative, records::kPositive, records::NearestOf,
    records::Range, records::ReadInput, records::ReadYamlText, records::YamlSection;
}  // namespace grouser::vehicle::yaml
