#pragma once

#include <initializer_list>

#include "grouser/v1alpha1/soil.pb.h"
#include "proto/records/yaml/yaml_section.h"

namespace grouser::records {

using Keys = std::initializer_list<const char*>;

/// Numbers whose keys are the names of the message's fields.
void ReadNumbers(YamlSection& section, Keys keys, google::protobuf::Message* out);
/// The same of those that are there.
void ReadOptional(YamlSection& section, Keys keys, google::protobuf::Message* out);

/// A wheel: name, radius_m, width_m, source, treads, and of its contact with grains restitution,
/// friction and rolling_friction. `with_contact`: these three, name and source have to be there,
/// as a DEM run needs them; else they may be missing. Refuses unknown keys.
void ReadWheel(YamlSection wheel, bool with_contact, v1alpha1::Wheel* out);

/// A file that holds a wheel alone, or one that has it under `wheel` (a scene). A wheel without a
/// name gets the file's. Throws InputError "FILE:LINE: key ...: got X, expected Y".
v1alpha1::Wheel LoadWheel(const std::string& file);

}  // namespace grouser::records
