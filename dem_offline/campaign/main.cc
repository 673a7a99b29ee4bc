#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <stdexcept>

#include "dem_offline/campaign/backend.h"
#include "dem_offline/campaign/commands.h"
#include "dem_offline/campaign/progress.h"
#include "dem_offline/scenes/yaml_section.h"
#include "proto/records/command_line.h"

namespace grouser::campaign {

namespace {

int Complain(const std::exception& error, int exit_code) {
  PutText(stderr, std::string("grouser-dem: ") + error.what() + "\n");
  return exit_code;
}

int Main(int argc, char** argv) {
  const StopSignals signals;
  // stdout carries data alone.
  spdlog::set_default_logger(spdlog::stderr_color_mt("grouser-dem"));
  CLI::App app(
      "grouser-dem: DEM experiments: wheel tests, one or a campaign of them, and any other.\n"
      "Exit codes: 0 done, 1 failed, 2 bad usage or input, 130/143 stopped by a signal.\n"
      "Each subcommand has its own --help with examples.",
      "grouser-dem");
  app.set_version_flag("--version",
                       fmt::format("grouser-dem {} (engine {}, {})", GROUSER_VERSION,
                                   EngineBackend().engine_version, EngineBackend().isa));
  app.footer("Pictures of a run: ./grouser dem view RUN (docs/experiments.md).");
  app.require_subcommand(1);
  Action action;
  AddRunCommand(app, &action);
  AddCampaignCommand(app, &action);
  AddShowCommand(app, &action);
  AddLawsCommand(app, &action);
  AddVerifyCommands(app, &action);
  AddBenchCommand(app, &action);
  AddExperimentCommands(app, &action);
  grouser::records::RefuseNaN(app);
  grouser::records::DescribeOnDemand(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error, std::cout, std::cerr) == 0 ? 0 : 2;
  }
  try {
    return action(signals);
  } catch (const InputError& error) {
    return Complain(error, 2);
  } catch (const std::invalid_argument& error) {
    return Complain(error, 2);
  } catch (const std::exception& error) {
    return Complain(error, 1);
  }
}

}  // namespace
}  // namespace grouser::campaign

int main(int argc, char** argv) { return grouser::campaign::Main(argc, argv); }
