#include "surrogate/fit/cone_card.h"

#include <fmt/format.h>

#include <algorithm>

#include "proto/records/message_json.h"
#include "proto/records/sha256.h"

namespace grouser::surrogate {
namespace {

void AddSoilLines(const std::string& path, const Json& node, std::vector<std::string>* lines) {
  if (node.is_object()) {
    for (const auto& [key, one] : node.items()) {
      AddSoilLines(path.empty() ? key : path + "." + key, one, lines);
    }
  } else if (node.is_array()) {
    for (std::size_t k = 0; k < node.size(); ++k) {
      AddSoilLines(fmt::format("{}[{}]", path, k), node[k], lines);
    }
  } else if (node.is_number()) {
    if (node != 0) lines->push_back(fmt::format("{}={:.9g}\n", path, node.get<double>()));
  } else if (node.is_string() && node != "") {
    lines->push_back(path + "=" + node.get<std::string>() + "\n");
  }
}

}  // namespace

std::string SoilIdentity(const v1alpha1::Soil& soil) {
  v1alpha1::Soil values = soil;
  values.clear_name();
  values.clear_source();
  std::vector<std::string> lines;
  AddSoilLines("", Json::parse(records::ToJson(values)), &lines);
  std::ranges::sort(lines);
  return records::Sha256OfString(fmt::format("{}", fmt::join(lines, "")));
}

std::optional<ConeIndex> ConeOf(const v1alpha1::Model& model, const std::vector<ConeIndex>& cones) {
  if (model.kind() == v1alpha1::MODEL_KIND_HARD) return std::nullopt;
  if (!model.soil().has_grains()) {
    const ConeIndex* named = FindConeIndex(cones, model.soil().name());
    return named == nullptr ? std::nullopt : std::optional(*named);
  }
  const auto found = std::ranges::find(cones, SoilIdentity(model.soil()), &ConeIndex::soil_sha256);
  return found == cones.end() ? std::nullopt : std::optional(*found);
}

std::string ConeCardText(const std::optional<ConeIndex>& cone) {
  return cone ? ConeText(*cone)
              : "cone index: not known of this soil (./grouser bevameter SOIL.yaml --tests cone; "
                "--cones OUT/cone_index.csv)\n";
}

Json ConeCardJson(const std::optional<ConeIndex>& cone) {
  return cone ? Json::parse(ConeListJson({*cone}))[0] : Json(nullptr);
}

}  // namespace grouser::surrogate
