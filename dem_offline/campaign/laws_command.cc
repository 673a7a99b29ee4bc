#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "dem_offline/campaign/commands.h"
#include "dem_offline/engine/laws/settings.h"

namespace grouser::campaign {
namespace {

constexpr char kLawsExamples[] = R"(Examples:
  grouser-dem laws
  grouser-dem laws --json    # [{"slot", "name", "settings": {...}}]
In a scene file:
  grains:
    ...
    contact: {normal: hertz_restitution, tangential: mindlin, rolling: epsd,
              cohesion: capillary, capillary: {surface_tension_n_per_m: 0.072}})";

int PrintJson() {
  using Json = nlohmann::ordered_json;
  Json out = Json::array();
  for (const dem::LawEntry& law : dem::LawRegistry()) {
    Json settings = Json::object();
    for (const auto& s : law.settings) settings[s.name] = s.value;
    out.push_back({{"slot", law.slot}, {"name", law.name}, {"settings", settings}});
  }
  fmt::print("{}\n", out.dump(1));
  return 0;
}

int PrintTable() {
  fmt::print("{:12} {:22} settings (default)\n", "slot", "law");
  for (const dem::LawEntry& law : dem::LawRegistry()) {
    std::string settings;
    for (const auto& s : law.settings) {
      settings += fmt::format("{}{} ({:g})", settings.empty() ? "" : ", ", s.name, s.value);
    }
    fmt::print("{:12} {:22} {}\n", law.slot, law.name, settings);
  }
  fmt::print("\nA combination that makes no sense is refused by name, with what is missing.\n");
  return 0;
}

}  // namespace

void AddLawsCommand(CLI::App& app, Action* action) {
  auto json = std::make_shared<bool>(false);
  CLI::App* laws = app.add_subcommand("laws", "The contact laws that a scene may name");
  laws->footer(kLawsExamples);
  laws->add_flag("--json", *json, "As a JSON array on stdout");
  laws->callback(
      [=] { *action = [json](const StopSignals&) { return *json ? PrintJson() : PrintTable(); }; });
}

}  // namespace grouser::campaign
