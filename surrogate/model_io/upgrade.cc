#include "surrogate/model_io/upgrade.h"

#include <algorithm>
#include <stdexcept>

#include "surrogate/model_io/write_model.h"

namespace grouser::surrogate {
namespace {

BekkerParameters FromValues(const google::protobuf::Map<std::string, double>& values) {
  const auto fields = BekkerFields();
  for (const auto& [name, value] : values) {
    if (std::none_of(fields.begin(), fields.end(), [&](const auto& f) { return name == f.name; })) {
      throw std::invalid_argument("bekker_values: unknown entry \"" + name + "\"");
    }
  }
  BekkerParameters parameters;
  for (const BekkerField& field : fields) {
    const auto found = values.find(field.name);
    if (found != values.end()) {
      parameters.*field.member = found->second;
    } else if (!field.optional) {
      throw std::invalid_argument(std::string("bekker_values: no entry \"") + field.name + "\"");
    }
  }
  return parameters;
}

// Without field 5, Bekker numbers that scenes could have and nothing used ("lite" messages
// cannot discard what they do not know).
v1alpha1::Soil KnownPart(const v1alpha1::Soil& from) {
  v1alpha1::Soil soil;
  soil.set_name(from.name());
  soil.set_bulk_density_kg_per_m3(from.bulk_density_kg_per_m3());
  soil.set_gravity_m_per_s2(from.gravity_m_per_s2());
  if (from.has_grains()) *soil.mutable_grains() = from.grains();
  soil.set_source(from.source());
  return soil;
}

}  // namespace

// The only reader of what the message calls deprecated.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
bool UpgradeModel(v1alpha1::Model* model) {
  if (!model->has_bekker_values() && !model->has_created_unix_s()) return false;
  if (model->has_soil()) *model->mutable_soil() = KnownPart(model->soil());
  try {
    if (model->has_bekker_values()) {
      if (model->has_bekker()) throw std::invalid_argument("both bekker and bekker_values");
      // A lookup's may be empty.
      const auto& values = model->bekker_values().values();
      if (!values.empty()) SetBekker(FromValues(values), model);
      model->clear_bekker_values();
    }
    if (model->has_created_unix_s()) {
      *model->mutable_create_time() = records::TimestampOf(model->created_unix_s());
      model->clear_created_unix_s();
    }
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error("model " + model->name() + ": " + error.what());
  }
  return true;
}
#pragma GCC diagnostic pop

records::LoadedModel ReadModel(const std::string& path) {
  return Upgraded(records::ReadModelFile(path), path);
}

records::LoadedModel Upgraded(records::LoadedModel loaded, const std::string& path) {
  try {
    UpgradeModel(&loaded.model);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
  return loaded;
}

}  // namespace grouser::surrogate
