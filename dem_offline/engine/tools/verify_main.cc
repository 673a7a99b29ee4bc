// grouser-verify: the engine checks itself, with nothing but the engine built.
#include "dem_offline/engine/tools/options.h"
#include "dem_offline/engine/verify/suite.h"

namespace {

using namespace grouser::dem::verify;

constexpr char kUsage[] =
    "usage: grouser-verify verify|torture [--quick|--full] [--case NAME] [--threads N]\n"
    "                      [--device cpu|cuda|emulated]\n"
    "                      [--json|--markdown] [--quiet]\n"
    "The table goes to stdout, progress to stderr. Exit status: 0 all rows pass, 1 one fails,\n"
    "2 bad usage.\n";

int Main(int argc, char** argv) {
  const std::string word = argc < 2 ? "" : argv[1];
  if (word != "verify" && word != "torture") {
    throw std::invalid_argument("expected verify or torture, got '" + word + "'");
  }
  SuiteCommand command;
  grouser::dem::Options options;
  options.Flag("--quick", &command.quick);
  options.Flag("--full", &command.full);
  options.Value("--case", &command.only);
  options.Value("--threads", &command.threads);
  options.Value("--device", &command.device);
  options.Flag("--json", &command.json);
  options.Flag("--markdown", &command.markdown);
  options.Flag("--quiet", &command.quiet);
  options.Parse(argc, argv, 2);
  return RunAndPrint(word == "verify" ? VerifySuite() : TortureSuite(), command, "grouser-verify");
}

}  // namespace

int main(int argc, char** argv) {
  return grouser::dem::RunProgram("grouser-verify", kUsage, argc, argv, Main);
}
