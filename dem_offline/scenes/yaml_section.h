#pragma once

#include "proto/records/yaml/yaml_section.h"

/// Scenes, campaigns and experiments read YAML by the shared reader, under their own namespace.
namespace grouser::campaign {
using records::InputError;
using records::kNonNegative;
using records::kPositive;
using records::NearestOf;
using records::Range;
using records::ReadYamlText;
using records::YamlSection;
}  // namespace grouser::campaign
