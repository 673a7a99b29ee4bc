#include "surrogate/fit/soil_card.h"

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

SoilCard SoilCardOf(const v1alpha1::Model& model, const std::vector<std::string>& bevameters,
                    const std::vector<std::string>& cones) {
  return {LineOfSoil(model, BevameterSoils(bevameters)), LineOfSoil(model, ConeIndices(cones))};
}

std::string SoilCardText(const SoilCard& card) {
  const std::string bevameter =
      card.bevameter
          ? BevameterText(*card.bevameter)
          : "soil parameters by a bevameter: not known of this soil (./grouser bevameter "
            "SOIL.yaml; --bevameters OUT/bevameter_soil.csv)\n";
  const std::string cone =
      card.cone ? ConeText(*card.cone)
                : "cone index: not known of this soil (./grouser bevameter SOIL.yaml --tests cone; "
                  "--cones OUT/cone_index.csv)\n";
  return bevameter + cone;
}

Json SoilCardJson(const SoilCard& card) {
  const auto only = [](const std::string& list) { return Json::parse(list)[0]; };
  return {{"bevameter", card.bevameter ? only(BevameterListJson({*card.bevameter})) : Json()},
          {"cone_index", card.cone ? only(ConeListJson({*card.cone})) : Json()}};
}

}  // namespace grouser::surrogate
