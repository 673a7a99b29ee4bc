#pragma once

#include <string>

#include "dem_offline/scenes/yaml_section.h"
#include "grouser/v1alpha1/campaign.pb.h"

namespace grouser::campaign {

/// Reads a scene file (*.scene.yaml): keys as the fields of v1alpha1.Scene; angles in degrees with
/// the ending _deg. `soil` is a mapping, or names a soil file: the same mapping in a file of its
/// own, looked for beside this one. soil_file: instead of the scene's soil; empty: none. within: as
/// of NeighbourOf. Throws InputError "FILE:LINE: key 'a.b': got X, expected Y".
v1alpha1::Scene LoadScene(const std::string& file, const std::string& soil_file = "",
                          const std::string& within = "");

/// The same from a mapping inside another file.
v1alpha1::Scene ReadScene(YamlSection section, const std::string& soil_file = "",
                          const std::string& within = "");

/// A soil file, or the mapping `soil` of a scene.
v1alpha1::Soil ReadSoil(YamlSection section);

}  // namespace grouser::campaign
