// grouser-engine-bench: times the engine on beds that its peers can run too.
// Plain program: builds on a machine that has nothing but a compiler.
#include "dem_offline/engine/bench/wheel.h"
#include "dem_offline/engine/bench/workload.h"
#include "dem_offline/engine/tools/options.h"

namespace {

using namespace grouser::dem;
using namespace grouser::dem::bench;

std::string Usage() {
  std::string out =
      "usage: grouser-engine-bench [OPTION VALUE ...] [--json]\n"
      "       grouser-engine-bench --export FILE ...   writes the bed in its order, times nothing\n"
      "       grouser-engine-bench --judge FILE [--from S --to S]   the stopping rule's verdict "
      "on\n"
      "         a wheel's series; means over that window alone\n"
      "The bed is made, or read from FILE where it is. Exit status: 0 done, 1 failed, 2 bad "
      "usage.\n";
  BenchOptions usual;
  ForEachOption(usual, [&](const std::string& name, auto&, const std::string& help) {
    out += "  " + name + std::string(24 - name.size(), ' ') + help + "\n";
  });
  return out;
}

int Main(int argc, char** argv) {
  BenchOptions o;
  std::string export_to, judge;
  double from = 0, to = 0;
  bool json = false;
  Options options;
  ForEachOption(o,
                [&](const char* name, auto& field, const char*) { options.Value(name, &field); });
  options.Value("--export", &export_to);
  options.Value("--judge", &judge);
  options.Value("--from", &from);
  options.Value("--to", &to);
  options.Flag("--json", &json);
  options.Parse(argc, argv);
  if (!judge.empty()) {
    const auto series = LoadSeries(judge);
    const WheelVerdict verdict = to > 0 ? Judge(series, from, to) : Judge(series, WheelBench{});
    std::puts(ToJson(verdict).c_str());
    return 0;
  }
  if (!export_to.empty()) {
    CheckOptions(o);
    SaveBed(OpenBed(o), export_to);
    return 0;
  }
  const BenchResult result = RunBench(o);
  std::fputs(((json ? ToJson(result) : ToText(result)) + (json ? "\n" : "")).c_str(), stdout);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return RunProgram("grouser-engine-bench", Usage().c_str(), argc, argv, Main);
}
