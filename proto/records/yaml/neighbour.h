#pragma once

#include <string>

#include "proto/records/yaml/yaml_section.h"

namespace grouser::records {

/// A file that `key` of a section names: from the folder of the section's own file. `within`: the
/// folder that it may not leave, a link of its own followed; empty: none. Throws InputError.
std::string NeighbourOf(YamlSection& section, const std::string& key,
                        const std::string& within = "");

}  // namespace grouser::records
