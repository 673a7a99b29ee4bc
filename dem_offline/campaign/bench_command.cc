#include <fmt/format.h>

#include <memory>

#include "dem_offline/campaign/commands.h"
#include "dem_offline/engine/bench/workload.h"

namespace grouser::campaign {
namespace {

constexpr char kBenchExamples[] = R"(Examples:
  grouser-dem bench                                # 20,000 grains at rest, one core
  grouser-dem bench --json --workload shear        # lists rebuild
  grouser-dem bench --particles 100000 --order shuffled --bed bed.csv   # made once, kept
  grouser-dem bench --cores 2 --worlds 2           # two worlds at a time
  grouser-dem bench --workload wheel --scene needed
What the numbers mean, and the peers' beside them: docs/performance.md.)";

}  // namespace

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
