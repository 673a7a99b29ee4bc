// grouser-ladder: speed against error, kind by kind, on the same test states.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <stdexcept>

#include "proto/records/command_line.h"
#include "proto/records/durable_file.h"
#include "proto/records/model_file.h"
#include "surrogate/accuracy_benchmark/benchmark.h"
#include "surrogate/accuracy_benchmark/promise.h"
#include "surrogate/accuracy_benchmark/targets.h"
#include "surrogate/soils/soil_table.h"

namespace {

using namespace grouser;
using namespace grouser::surrogate;

constexpr const char* kFooter =
    "Examples:\n"
    "  grouser-ladder --json\n"
    "  grouser-ladder surrogate/pairs/cmu-smooth-62.5-8mm --markdown ladder.md\n"
    "  grouser-ladder fit surrogate/pairs/cmu-smooth-62.5-8mm   # models from its runs.json\n"
    "  grouser-ladder promise surrogate/pairs/cmu-smooth-62.5-8mm   # tolerances, met and kept\n"
    "Exit codes: 0 ok, 1 failed, 2 usage or bad input.";

struct BenchmarkRequest {
  std::string folder = SurrogateFile("pairs"), soils = PublishedSoilsFile(), markdown;
  double seconds = 0.5;
  bool json = false, accept_unusual = false;
};

void PrintBenchmark(const BenchmarkRequest& asked) {
  if (!asked.markdown.empty()) records::MakeFolderFor(asked.markdown);
  std::vector<BenchmarkRow> rows;
  std::vector<Target> targets;
  for (const PairFolder& pair : FindPairs(asked.folder, asked.soils, asked.accept_unusual)) {
    const auto own = RunAccuracyBenchmark(pair, asked.seconds);
    rows.insert(rows.end(), own.begin(), own.end());
    const auto reached = TargetsOf(own, pair);
    targets.insert(targets.end(), reached.begin(), reached.end());
  }
  if (asked.json) {
    fmt::print("{}\n", BenchmarkJson(rows));
  } else {
    fmt::print("{}\nTargets of the default kind, hybrid, and of speed:\n{}", BenchmarkText(rows),
               TargetsText(targets));
  }
  if (!asked.markdown.empty()) {
    records::WriteFileDurably(asked.markdown, BenchmarkMarkdown(rows, targets));
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Time and error of every kind, against full DEM on the same test states.");
  app.name("grouser-ladder");
  app.set_version_flag("--version", "grouser-ladder " GROUSER_VERSION);
  app.footer(kFooter);
  BenchmarkRequest asked_for;
  std::string fitted;
  app.add_option("folder", asked_for.folder,
                 "a pair's folder, or one of pairs (default: surrogate/pairs)");
  app.add_flag("--json", asked_for.json, "machine-readable rows on stdout");
  app.add_option("--markdown", asked_for.markdown, "tables for docs/speed-vs-error.md to write");
  app.add_option("--soils", asked_for.soils, "table of published soils")->capture_default_str();
  app.add_option("--seconds", asked_for.seconds, "spent on the timing of each kind")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  const auto accept = [&asked_for](CLI::App* command) {
    command->add_flag("--accept-unusual", asked_for.accept_unusual,
                      "take soils outside the range of published ones, and measured angles that "
                      "read like radians");
  };
  accept(&app);
  CLI::App* fit = app.add_subcommand("fit", "Fit hybrid, lookup and bekker to a pair's runs.json");
  fit->add_option("folder", fitted, "the pair's folder")->required();
  accept(fit);
  CLI::App* promise =
      app.add_subcommand("promise", "Tolerances at a pair's test states: met by whom, and kept");
  PromiseOptions asked;
  promise->add_option("folder", fitted, "the pair's folder")->required();
  promise->add_option("--costs", asked.cost_ns, "of bekker, lookup, hybrid [ns]; default: measured")
      ->delimiter(',');
  promise->add_flag("--training-only", asked.without_held_out,
                    "leave the held-out rows of the models' error tables out");
  promise->add_flag("--json", asked_for.json, "machine-readable rows on stdout");
  grouser::records::RefuseNaN(app);
  grouser::records::DescribeOnDemand(app);
  try {
    app.parse(argc, argv);
    if (promise->parsed()) {
      const Promise kept = MeasurePromise(fitted, asked);
      fmt::print("{}", asked_for.json ? PromiseJson(kept) : PromiseText(kept));
      return 0;
    }
    if (fit->parsed()) {
      FitPair(fitted, "grouser-ladder fit", asked_for.accept_unusual,
              [](const std::string& line) { fmt::print(stderr, "grouser-ladder: {}\n", line); });
      return 0;
    }
    PrintBenchmark(asked_for);
    return 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::invalid_argument& error) {
    fmt::print(stderr, "grouser-ladder: {}\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "grouser-ladder: {}\n", error.what());
    return 1;
  }
}
