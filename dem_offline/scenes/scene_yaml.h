#pragma once

#include <string>

#include "dem_offline/scenes/yaml_section.h"
#include "grouser/v1alpha1/campaign.pb.h"

namespace grouser::campaign {

/// Reads a scene file (*.scene.yaml): keys as the fields of v1alpha1.Scene; angles in degrees with
/// the ending _deg. `soil` is a mapping, or names a soil file: the same mapping in a file of its
/// own, looked for beside this one. soil_file: instead of the scene's soil; empty: none. Throws
/// InputError "FILE:LINE: key 'a.b': got X, expected Y".
v1alpha1::Scene LoadScene(const std::string& file, const std::string& soil_file = "");

/// The same from a mapping inside another file.
v1alpha1::Scene ReadScene(YamlSection section, const std::string& soil_file = "");

/// A soil file, or the mapping `soil` of a scene.
v1alpha1::Soil ReadSoil(YamlSection section);

/// A file that `key` of a section names: from the folder of the section's own file.
std::string NeighbourOf(YamlSection& section, const std::string& key);

}  // namespace grouser::campaign
