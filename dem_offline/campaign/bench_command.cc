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
  bench->add_option("--workload", o->workload, "bed, shear or wheel")->capture_default_str();
  bench->add_option("--particles", o->particles, "Grains of a world")->capture_default_str();
  bench->add_option("--cores", o->cores, "Threads, of one world or one a world")
      ->capture_default_str();
  bench->add_option("--device", o->device, "cpu, cuda, or emulated")->capture_default_str();
  bench->add_option("--order", o->order, "Of the grains given to the engine: sorted or shuffled")
      ->capture_default_str();
  bench->add_option("--worlds", o->worlds, "Worlds at a time")->capture_default_str();
  bench->add_option("--tangential", o->laws.tangential, "Tangential law of the contacts")
      ->capture_default_str();
  bench->add_option("--rolling", o->laws.rolling, "Rolling law of the contacts")
      ->capture_default_str();
  bench->add_option("--steps", o->steps, "Timed steps")->capture_default_str();
  bench->add_option("--repeat", o->repeat, "Times; the median counts")->capture_default_str();
  bench->add_option("--seed", o->seed, "Of the bed")->capture_default_str();
  bench->add_option("--bed", o->bed, "File of the bed: read, or made and written");
  bench->add_option("--scene", o->scene, "wheel: full, or needed (window, freezing, largest step)")
      ->capture_default_str();
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
