// grouser-verify: the engine checks itself, with nothing but the engine built.
#include <cstdio>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <string>

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
  if (argc < 2) throw std::invalid_argument("expected verify or torture");
  const std::string word = argv[1];
  if (word != "verify" && word != "torture") {
    throw std::invalid_argument(word + ": expected verify or torture");
  }
  SuiteOptions options;
  Output output = Output::kTable;
  std::string command = "grouser-verify " + word;
  for (int i = 2; i < argc; ++i) {
    const std::string flag = argv[i];
    const auto value = [&] {
      if (++i >= argc) throw std::invalid_argument(flag + ": expected a value");
      return std::string(argv[i]);
    };
    if (flag == "--quick") {
      options.level = Level::kQuick;
    } else if (flag == "--full") {
      options.level = Level::kFull;
    } else if (flag == "--case") {
      options.only = value();
    } else if (flag == "--threads") {
      options.threads = std::stoi(value());
    } else if (flag == "--device") {
      options.device = value();
      options.threads = 1;
      command += " --device " + options.device;
      continue;
    } else if (flag == "--json") {
      output = Output::kJson;
    } else if (flag == "--markdown") {
      output = Output::kMarkdown;
    } else if (flag == "--quiet") {
      options.progress = false;
    } else {
      throw std::invalid_argument(flag + ": unknown");
    }
    if (flag != "--quiet") command += " " + flag;
  }
  const Suite suite = word == "verify" ? VerifySuite() : TortureSuite();
  return RunAndPrint(suite, options, output, command);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Main(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "grouser-verify: %s\n%s", error.what(), kUsage);
    return 2;
  }
}
