// The tables of keys as a JSON schema.
#include <nlohmann/json.hpp>

#include "surrogate/vehicle/vehicle_file.h"
#include "surrogate/vehicle/vehicle_keys.h"

namespace grouser::vehicle {
namespace {

using Json = nlohmann::ordered_json;

Json Text(const char* what) {
  return {{"type", "string"}, {"minLength", 1}, {"description", what}};
}
Json ListOf(const Json& items) {
  return {{"anyOf", {items, {{"type", "array"}, {"items", items}, {"minItems", 1}}}}};
}
Json Numbers(int n, const char* what) {
  return {{"type", "array"},
          {"items", {{"type", "number"}}},
          {"minItems", n},
          {"maxItems", n},
          {"description", what}};
}

template <class T>
Json Section(std::span<const NumberKey<T>> keys, const Json& others,
             std::vector<std::string> must) {
  Json properties = others;
  for (const NumberKey<T>& k : keys) {
    Json number = {{"type", "number"}};
    if (k.range == NumberKey<T>::Range::kPositive) number["exclusiveMinimum"] = 0;
    if (k.range == NumberKey<T>::Range::kNonNegative) number["minimum"] = 0;
    if (*k.what) number["description"] = k.what;
    properties[k.key] = number;
    if (k.required) must.push_back(k.key);
  }
  return {{"type", "object"},
          {"properties", properties},
          {"required", must},
          {"additionalProperties", false}};
}

}  // namespace

std::string VehicleSchema() {
  const Json type = Section(WheelTypeKeys(), {{"name", Text("")}}, {"name"});
  const Json drive = Section<Motor>({},
                                    {{"name", Text("")},
                                     {"coupling", {{"enum", kCouplingNames}}},
                                     {"motor", Section(MotorKeys(), Json::object(), {})}},
                                    {"name", "coupling"});
  const Json wheel = Section(WheelKeys(),
                             {{"name", Text("")},
                              {"type", Text("name of a wheel type")},
                              {"at_m", Numbers(2, "x forward, y left, of the contact")},
                              {"drive", Text("name of its drive; without one it rolls freely")},
                              {"steered", {{"type", "boolean"}}},
                              {"bogie", Text("wheels of one bogie share their load equally")}},
                             {"name", "type", "at_m"});
  Json ground = Section<Motor>({},
                               {{"soil", Text("")},
                                {"wheel", Text("name of a wheel type")},
                                {"model", Text("model file, named from this file's folder")},
                                {"scaled", {{"type", "boolean"}}},
                                {"hard", Section(HardKeys(), Json::object(), {})}},
                               {"soil", "wheel"});
  ground["oneOf"] = {{{"required", {"model"}}}, {{"required", {"hard"}}}};
  const Json mixture =
      Section<Motor>({},
                     {{"soil", Text("name of the mixture")},
                      {"of",
                       {{"type", "object"},
                        {"minProperties", 1},
                        {"additionalProperties", {{"type", "number"}, {"minimum", 0}}},
                        {"description", "soils of `grounds`, each with how likely it is"}}}},
                     {"soil", "of"});
  Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                 {"title", "Grouser vehicle file"}};
  schema.update(Section(VehicleKeys(),
                        {{"name", Text("")},
                         {"sources", ListOf({{"type", "string"}})},
                         {"centre_m", Numbers(3,
                                              "of gravity: x forward, y left, z up from the "
                                              "ground, in the axes of the wheels")},
                         {"wheel_types", ListOf(type)},
                         {"wheels", ListOf(wheel)},
                         {"drives", ListOf(drive)},
                         {"steering", Section(SteeringKeys(), Json::object(), {})},
                         {"grounds", ListOf(ground)},
                         {"mixtures", ListOf(mixture)}},
                        {"name", "centre_m", "wheel_types", "wheels", "drives", "grounds"}));
  return schema.dump(1) + "\n";
}

}  // namespace grouser::vehicle
