// grouser-engine-bench: times the engine on beds that its peers can run too.
// Plain program: builds on a machine that has nothing but a compiler.
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>

#include "dem_offline/engine/bench/wheel.h"
#include "dem_offline/engine/bench/workload.h"

namespace {

using namespace grouser::dem::bench;

constexpr char kUsage[] =
    "usage: grouser-engine-bench [--workload bed|shear|wheel] [--particles N] [--cores C]\n"
    "         [--device cpu|cuda|emulated] [--order sorted|shuffled] [--worlds W] [--steps S] "
    "[--warmup S]\n"
    "         [--repeat R] [--tangential LAW] [--rolling LAW] [--physics-samples K] [--seed S] "
    "[--skin M]\n"
    "         [--preparation-friction F]\n"
    "         [--bed FILE] [--scene full|needed] [--wheel-sides N] [--series FILE]\n"
    "         [--json]\n"
    "       grouser-engine-bench --export FILE ...   writes the bed in its order, times nothing\n"
    "       grouser-engine-bench --judge FILE [--from S --to S]   the stopping rule's verdict on "
    "a\n"
    "         wheel's series; means over that window alone\n"
    "The bed is made, or read from FILE where it is. Exit status: 0 done, 1 failed, 2 bad usage.\n";

int Main(int argc, char** argv) {
  BenchOptions o;
  std::string export_to, judge;
  double from = 0, to = 0;
  bool json = false;
  for (int i = 1; i < argc; ++i) {
    const std::string flag = argv[i];
    const auto value = [&] {
      if (++i >= argc) throw std::invalid_argument(flag + ": expected a value");
      return std::string(argv[i]);
    };
    if (flag == "--workload") {
      o.workload = value();
    } else if (flag == "--particles") {
      o.particles = std::stoll(value());
    } else if (flag == "--cores") {
      o.cores = std::stoi(value());
    } else if (flag == "--device") {
      o.device = value();
    } else if (flag == "--order") {
      o.order = value();
    } else if (flag == "--scene") {
      o.scene = value();
    } else if (flag == "--series") {
      o.series = value();
    } else if (flag == "--wheel-sides") {
      o.wheel_sides = std::stoi(value());
    } else if (flag == "--judge") {
      judge = value();
    } else if (flag == "--from") {
      from = std::stod(value());
    } else if (flag == "--to") {
      to = std::stod(value());
    } else if (flag == "--rolling") {
      o.laws.rolling = value();
    } else if (flag == "--tangential") {
      o.laws.tangential = value();
    } else if (flag == "--worlds") {
      o.worlds = std::stoi(value());
    } else if (flag == "--steps") {
      o.steps = std::stoll(value());
    } else if (flag == "--warmup") {
      o.warmup = std::stoll(value());
    } else if (flag == "--repeat") {
      o.repeat = std::stoi(value());
    } else if (flag == "--physics-samples") {
      o.physics_samples = std::stoi(value());
    } else if (flag == "--seed") {
      o.seed = std::stoull(value());
    } else if (flag == "--preparation-friction") {
      o.preparation_friction = std::stod(value());
    } else if (flag == "--skin") {
      o.skin_m = std::stod(value());
    } else if (flag == "--bed") {
      o.bed = value();
    } else if (flag == "--export") {
      export_to = value();
    } else if (flag == "--json") {
      json = true;
    } else if (flag == "--help") {
      std::fputs(kUsage, stdout);
      return 0;
    } else {
      throw std::invalid_argument(flag + ": unknown");
    }
  }
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
  try {
    return Main(argc, argv);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "grouser-engine-bench: %s\n%s", error.what(), kUsage);
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "grouser-engine-bench: %s\n", error.what());
    return 1;
  }
}
