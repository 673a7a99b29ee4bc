// What the engine says of itself: its laws, its checks, its speed.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "dem_offline/campaign/commands.h"
#include "dem_offline/engine/bench/workload.h"
#include "dem_offline/engine/laws/settings.h"
#include "dem_offline/engine/verify/suite.h"

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

constexpr char kVerifyExamples[] = R"(Examples:
  grouser-dem verify                 # the engine against exact and published answers
  grouser-dem torture --json         # cases chosen to break it
  grouser-dem verify --case oblique_impact
  grouser-dem verify --markdown   # as the tables of docs/verification.md
The table goes to stdout, progress to stderr. Exit code: 0 all rows pass, 1 one fails.)";

void AddSuite(CLI::App& app, Action* action, const char* name, const char* about,
              dem::verify::Suite (*make)()) {
  auto arguments = std::make_shared<dem::verify::SuiteCommand>();
  CLI::App* command = app.add_subcommand(name, about);
  command->footer(kVerifyExamples);
  auto* quick = command->add_flag("--quick", arguments->quick, "Cases of seconds alone");
  command->add_flag("--full", arguments->full, "All cases, hours included")->excludes(quick);
  auto* json = command->add_flag("--json", arguments->json, "Rows as a JSON array on stdout");
  command->add_flag("--markdown", arguments->markdown, "Rows as a Markdown table on stdout")
      ->excludes(json);
  command->add_option("--case", arguments->only, "This case alone, whatever its class");
  command->add_option("--threads", arguments->threads, "Cases at a time")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  command->add_option("--device", arguments->device, "Where worlds are stepped")
      ->check(CLI::IsMember({"cpu", "cuda", "emulated"}))
      ->capture_default_str();
  command->add_flag("--quiet", arguments->quiet, "No progress on stderr");
  command->callback([=] {
    *action = [arguments, make](const StopSignals& signals) {
      signals.EndAtOnce();
      return RunAndPrint(make(), *arguments, "./grouser dem");
    };
  });
}

constexpr char kBenchExamples[] = R"(Examples:
  grouser-dem bench                                # 20,000 grains at rest, one core
  grouser-dem bench --json --workload shear        # lists rebuild
  grouser-dem bench --particles 100000 --order shuffled --bed bed.csv   # made once, kept
  grouser-dem bench --cores 2 --worlds 2           # two worlds at a time
  grouser-dem bench --workload wheel --scene needed
What the numbers mean, and the peers' beside them: docs/performance.md.)";

}  // namespace

void AddLawsCommand(CLI::App& app, Action* action) {
  auto json = std::make_shared<bool>(false);
  CLI::App* laws = app.add_subcommand("laws", "The contact laws that a scene may name");
  laws->footer(kLawsExamples);
  laws->add_flag("--json", *json, "As a JSON array on stdout");
  laws->callback(
      [=] { *action = [json](const StopSignals&) { return *json ? PrintJson() : PrintTable(); }; });
}

void AddVerifyCommands(CLI::App& app, Action* action) {
  AddSuite(app, action, "verify", "The engine against exact and published answers",
           dem::verify::VerifySuite);
  AddSuite(app, action, "torture", "Numerical stability on cases chosen to break the engine",
           dem::verify::TortureSuite);
}

void AddBenchCommand(CLI::App& app, Action* action) {
  auto o = std::make_shared<dem::bench::BenchOptions>();
  auto json = std::make_shared<bool>(false);
  CLI::App* bench = app.add_subcommand("bench", "Times the engine on beds that its peers run too");
  bench->footer(kBenchExamples);
  ForEachOption(*o, [&](const char* name, auto& field, const char* help) {
    bench->add_option(name, field, help)->capture_default_str();
  });
  bench->add_flag("--json", *json, "As a JSON object on stdout");
  bench->callback([=] {
    *action = [o, json](const StopSignals& signals) {
      signals.EndAtOnce();
      const dem::bench::BenchResult result = dem::bench::RunBench(*o);
      fmt::print("{}{}", *json ? ToJson(result) : ToText(result), *json ? "\n" : "");
      return 0;
    };
  });
}

}  // namespace grouser::campaign
