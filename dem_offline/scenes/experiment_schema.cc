// The table of keys as a JSON Schema and as Markdown.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "dem_offline/engine/laws/settings.h"
#include "dem_offline/scenes/experiment_keys.h"

namespace grouser::campaign {
namespace {

using Json = nlohmann::ordered_json;

Json ListOfThree(const char* type) {
  return {{"type", "array"}, {"items", {{"type", type}}}, {"minItems", 3}, {"maxItems", 3}};
}

Json TypeOf(const Key& k) {
  const Json section = {{"$ref", std::string("#/$defs/") + k.more}};
  switch (k.kind) {
    case KeyKind::kNumber:
    case KeyKind::kDegrees:
      return {{"type", "number"}};
    case KeyKind::kCount:
      return {{"type", "integer"}, {"minimum", 0}};
    case KeyKind::kText:
      return {{"type", "string"}};
    case KeyKind::kTexts:
      return {{"type", "array"}, {"items", {{"type", "string"}}}, {"minItems", 2}, {"maxItems", 2}};
    case KeyKind::kChoice:
      return {{"enum", SplitChoices(k.more)}};
    case KeyKind::kChoices:
      return {{"type", "array"},
              {"items", {{"enum", SplitChoices(k.more)}}},
              {"minItems", 1},
              {"uniqueItems", true}};
    case KeyKind::kSwitch:  // YAML 1.1 reads on, off, yes and no as booleans
      return {{"enum", {"on", "off", "yes", "no", true, false}}};
    case KeyKind::kVector:
    case KeyKind::kAngles:
      return ListOfThree("number");
    case KeyKind::kCounts:
      return ListOfThree("integer");
    case KeyKind::kNumbers:
      return {{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 1}};
    case KeyKind::kValues:
      return {{"type", "array"}, {"minItems", 1}};
    case KeyKind::kSection:
      return section;
    case KeyKind::kSections:
      return {{"anyOf", {section, {{"type", "array"}, {"items", section}, {"minItems", 1}}}}};
    case KeyKind::kLaws:
      break;
  }
  return {};
}

void AddLaws(Json* properties) {
  for (const dem::LawEntry& law : dem::LawRegistry()) {
    if (law.settings.empty()) continue;
    Json settings = Json::object();
    for (const dem::NamedSetting& s : law.settings) settings[s.name] = {{"type", "number"}};
    (*properties)[law.name] = {{"type", "object"},
                               {"description", "settings of the law " + law.name},
                               {"properties", settings},
                               {"additionalProperties", false}};
  }
}

Json SchemaOf(const std::string& section) {
  Json out = {{"type", "object"}, {"additionalProperties", false}};
  Json properties = Json::object(), required = Json::array(), rules = Json::array();
  const std::string selector = SelectorOf(section);
  std::vector<std::string> choices;
  for (const Key& k : ExperimentKeys()) {
    if (section != k.section) continue;
    if (k.kind == KeyKind::kLaws) {
      AddLaws(&properties);
      continue;
    }
    Json property = TypeOf(k);
    if (*k.what) property["description"] = k.what;
    properties[k.name] = property;
    if (std::string(k.otherwise) == "!" && *k.of == '\0') required.push_back(k.name);
    if (selector == k.name) choices = SplitChoices(k.more);
  }
  for (const std::string& choice : choices) {  // keys that do not go with it
    Json none = Json::object();
    for (const Key& k : ExperimentKeys()) {
      if (section != k.section || *k.of == '\0') continue;
      const auto of = SplitChoices(k.of);
      if (std::find(of.begin(), of.end(), choice) == of.end()) none[k.name] = false;
    }
    rules.push_back({{"if", {{"properties", {{selector, {{"const", choice}}}}}}},
                     {"then", {{"properties", none}}}});
  }
  out["properties"] = properties;
  if (!required.empty()) out["required"] = required;
  if (!rules.empty()) out["allOf"] = rules;
  return out;
}

std::vector<std::string> SectionNames() {
  std::vector<std::string> out;
  for (const Key& k : ExperimentKeys()) {
    if (std::find(out.begin(), out.end(), k.section) == out.end()) out.push_back(k.section);
  }
  return out;
}

const char* TypeForPeople(const Key& k) {
  switch (k.kind) {
    case KeyKind::kNumber:
      return "number";
    case KeyKind::kDegrees:
      return "degrees";
    case KeyKind::kCount:
      return "whole number";
    case KeyKind::kText:
      return "text";
    case KeyKind::kTexts:
      return "two texts";
    case KeyKind::kSwitch:
      return "on or off";
    case KeyKind::kVector:
      return "three numbers";
    case KeyKind::kAngles:
      return "three angles";
    case KeyKind::kCounts:
      return "three whole numbers";
    case KeyKind::kNumbers:
      return "list of numbers";
    case KeyKind::kValues:
      return "list of values";
    default:
      return "";
  }
}

}  // namespace

std::string ExperimentSchema() {
  Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                 {"title", "Grouser experiment"}};
  schema.update(SchemaOf(""));
  Json defs = Json::object();
  for (const std::string& section : SectionNames()) {
    if (!section.empty()) defs[section] = SchemaOf(section);
  }
  schema["$defs"] = defs;
  return schema.dump(1) + "\n";
}

std::string ExperimentKeyTable() {
  std::string out;
  for (const std::string& section : SectionNames()) {
    out += fmt::format(
        "### {}\n\n| key | value | left out | of | meaning |\n| --- | --- | --- | "
        "--- | --- |\n",
        section.empty() ? "The file" : "`" + section + "`");
    for (const Key& k : ExperimentKeys()) {
      if (section != k.section) continue;
      std::string value = TypeForPeople(k), name = fmt::format("`{}`", k.name);
      if (k.kind == KeyKind::kChoice)
        value = fmt::format("{}", fmt::join(SplitChoices(k.more), ", "));
      if (k.kind == KeyKind::kChoices) {
        value = fmt::format("list of: {}", fmt::join(SplitChoices(k.more), ", "));
      }
      if (k.kind == KeyKind::kSection) value = fmt::format("a `{}`", k.more);
      if (k.kind == KeyKind::kSections) value = fmt::format("list of `{}`", k.more);
      if (k.kind == KeyKind::kLaws) {
        name = "name of a law";
        value = "its settings";
      }
      const bool required = std::string(k.otherwise) == "!";
      out += fmt::format("| {} | {} | {} | {} | {} |\n", name, value,
                         required ? "required" : k.otherwise, fmt::join(SplitChoices(k.of), ", "),
                         k.what);
    }
    out += "\n";
  }
  return out;
}

}  // namespace grouser::campaign
