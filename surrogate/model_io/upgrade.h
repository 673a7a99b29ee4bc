#pragma once

#include <string>

#include "proto/records/model_file.h"

namespace grouser::surrogate {

/// Turns a message as files of earlier versions hold it into today's form: `bekker_values` into
/// `bekker`, `created_unix_s` into `create_time`; field 5 of the soil is dropped. Returns whether
/// there was anything to turn. Throws std::runtime_error "model NAME: bekker_values: ..." for a
/// parameter that is unknown or missing.
bool UpgradeModel(v1alpha1::Model* model);

/// A model file of any version, its message in today's form; the digest is that of the file as
/// it is. Throws as records::ReadModelFile and UpgradeModel.
records::LoadedModel ReadModel(const std::string& path);

/// What was read from `path`, its message in today's form. Throws as UpgradeModel.
records::LoadedModel Upgraded(records::LoadedModel loaded, const std::string& path);

}  // namespace grouser::surrogate
