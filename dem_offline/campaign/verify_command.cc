#include <memory>

#include "dem_offline/campaign/commands.h"
#include "dem_offline/engine/verify/suite.h"

namespace grouser::campaign {
namespace {

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

}  // namespace

void AddVerifyCommands(CLI::App& app, Action* action) {
  AddSuite(app, action, "verify", "The engine against exact and published answers",
           dem::verify::VerifySuite);
  AddSuite(app, action, "torture", "Numerical stability on cases chosen to break the engine",
           dem::verify::TortureSuite);
}

}  // namespace grouser::campaign
