// grouser-client: queries and jobs from the command line.
#include <iostream>

#include "clients/cli/commands.h"
#include "clients/cpp/access_options.h"
#include "proto/records/command_line.h"

namespace {

constexpr const char* kExamples =
    "Examples:\n"
    "  grouser-client query --slip 0.2 --angle-deg 30 --load 24\n"
    "  grouser-client query --slip 0.1 0.2 0.4 --load 24 --json\n"
    "  grouser-client query --vx 0.08 --vy 0 --rim 0.1 --load 24 --model "
    "cmu-smooth-62.5@candidate\n"
    "  grouser-client query --slip 0.2 --load 24 --tolerance f_x=2,sinkage=0.004 --model NAME\n"
    "  grouser-client query --explain --slip 0.2 --load 24 --runs 3\n"
    "  grouser-client models\n"
    "  grouser-client submit --slip 0.3 --angle-deg 20 --load 24 --watch\n"
    "  grouser-client calibrate soil my-sand.yaml --watch\n"
    "  grouser-client promote JOB --candidate DIGEST --who me --why 'held-out error fell'\n"
    "  grouser-client model move NAME@canary --to stable --who me --why 'a week without "
    "complaint'\n"
    "  grouser-client model rollback NAME --who me --why 'worse on the slope'\n"
    "Exit codes: 0 ok, 1 failed, 2 usage, or every state of a query INVALID.";

}  // namespace

int main(int argc, char** argv) {
  using namespace grouser::cli;
  CLI::App app{"Asks a Grouser server what a wheel will do on its soil."};
  app.footer(kExamples);
  app.set_version_flag("--version", "grouser-client " GROUSER_VERSION);
  app.require_subcommand(1);
  app.fallthrough();
  auto common = std::make_shared<Common>();
  const auto* server =
      app.add_option("--server", common->server, "grouser-server, HOST:PORT or unix:PATH")
          ->capture_default_str();
  const auto* jobs = app.add_option("--jobs", common->jobs, "grouser-jobs, HOST:PORT or unix:PATH")
                         ->capture_default_str();
  grouser::client::AddAccessOptions(app, &common->access);
  app.add_flag("--json", common->json, "JSON on stdout");
  app.add_option("--deadline-ms", common->deadline_ms, "Limit of one call [ms]")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  Action action;
  AddQueryCommands(app, common, &action);
  AddJobCommands(app, common, &action);
  AddWorkCommands(app, common, &action);
  AddAliasCommands(app, common, &action);
  grouser::records::RefuseNaN(app);
  grouser::records::DescribeOnDemand(app);
  try {
    app.parse(argc, argv);
    common->server_alone = *server && !*jobs;
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitOk : kExitUsage;
  }
  try {
    return action();
  } catch (const CLI::ParseError& e) {  // a combination that makes no sense
    std::cerr << "grouser-client: " << e.what() << "\n";
    return kExitUsage;
  } catch (const std::invalid_argument& e) {
    std::cerr << "grouser-client: " << e.what() << "\n";
    return kExitUsage;
  } catch (const std::exception& e) {
    std::cerr << "grouser-client: " << e.what() << "\n";
    return kExitFailed;
  }
}
