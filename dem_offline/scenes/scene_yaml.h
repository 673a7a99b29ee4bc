#pragma once

#include <string>

#include "dem_offline/scenes/yaml_section.h"
#include "grouser/v1alpha1/campaign.pb.h"

namespace grouser::campaign {

/// Reads a scene file (*.scene.yaml): keys as the fields of v1alpha1.Scene, all
/// required but `soil.bekker`; angles in degrees with the ending _deg. Throws
/// InputError "FILE:LINE: key 'a.b': got X, expected Y".
v1alpha1::Scene LoadScene(const std::string& file);

/// The same from a mapping inside another file.
v1alpha1::Scene ReadScene(YamlSection section);

}  // namespace grouser::campaign
