// grouser-scene-study: what each switch of the reduced domain does to a wheel test.
// The same wheel, soil and seeds with one switch changed at a time, against the full model; each
// finished run is a line of a file, so that a study that was stopped goes on where it was.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "dem_offline/engine/rig/wheel_test.h"

namespace grouser::dem {
namespace {

constexpr double kDegree = M_PI / 180;
const char* const kOutputs[] = {"f_x", "f_y", "torque", "sinkage"};

struct Options {
  std::string file = "scene_study.tsv";
  int first_seed = 1, seeds = 4;
  double diameter_m = 0.009, max_time_s = 1.6;
  std::string rows, states;
  bool table_only = false;
};

/// One line of the study: a name and what it changes of the full model.
struct Row {
  std::string name;
  std::function<void(WheelTestSpec*)> change;
  bool own_tile = false;  ///< the change needs a bed of its own
};

struct State {
  std::string name;
  double slip, attack_deg, load_n;
};

/// What is kept of one run.
struct Outcome {
  std::string status, stopped;
  double mean[4] = {}, error[4] = {};
  double steps = 0, particle_steps = 0, active = 0, deep = 0, cpu_s = 0, end_s = 0, p99 = 0,
         residual = 0;
};

std::vector<State> States() {
  return {{"drive", 0.3, 0, 24}, {"lateral", 0.2, 60, 24}, {"locked", -1, 0, 24}};
}

/// Coarse and soft, smooth wheel of the CMU testbed (campaigns/cmu_smooth_demo.scene.yaml).
WheelTestSpec FullModel(const Options& o, const State& state, int seed) {
  WheelTestSpec s;
  s.soil.density_kg_per_m3 = 2293.1;
  s.soil.youngs_modulus_pa = 5e6;
  s.soil.friction = 0.55;
  s.soil.rolling_friction = 0.3;
  const double d = o.diameter_m;
  s.soil.sizes = {{0.9 * d, 0.25}, {d, 0.5}, {1.1 * d, 0.25}};
  s.wheel.friction = 0.5;
  s.wheel.rolling_friction = 0.3;
  s.rig.max_time_s = o.max_time_s;
  s.rig.target_relative_error = 1e-9;  // to the end
  s.rig.scene = FullDomain();
  s.state.slip = state.slip;
  s.state.attack_angle_rad = state.attack_deg * kDegree;
  s.state.load_n = state.load_n;
  s.seed = static_cast<std::uint64_t>(seed);
  return s;
}

void FreezeWith(WheelTestSpec* s, double box, double speed) {
  s->rig.scene.freeze = true;
  s->rig.scene.freeze_box = box;
  s->rig.scene.freeze_speed = speed;
}

void WindowOf(WheelTestSpec* s, double tiles) {
  s->rig.scene.bed = SceneBed::kWindow;
  s->rig.scene.window_length_m = tiles * s->rig.bed_length_m;
}

void ScaleStiffness(WheelTestSpec* s, double factor) { s->soil.youngs_modulus_pa *= factor; }

std::vector<Row> Rows() {
  const auto step = [](double fraction) {
    return [fraction](WheelTestSpec* s) { s->rig.rayleigh_fraction = fraction; };
  };
  const auto window = [](double tiles) {
    return [tiles](WheelTestSpec* s) { WindowOf(s, tiles); };
  };
  const auto freeze = [](double box, double speed) {
    return [box, speed](WheelTestSpec* s) { FreezeWith(s, box, speed); };
  };
  return {
      {"full", [](WheelTestSpec*) {}},
      {"periodic", [](WheelTestSpec* s) { s->rig.scene.bed = SceneBed::kPeriodic; }},
      {"window", [](WheelTestSpec* s) { s->rig.scene.bed = SceneBed::kWindow; }},
      {"window x2", window(2)},
      {"window x1.5", window(1.5)},
      {"window x1", window(1)},
      {"window x0.8", window(0.8)},
      {"freeze box 2.5, 0.01", freeze(2.5, 0.01)},
      {"freeze box 1.75, 0.01", freeze(1.75, 0.01)},
      {"freeze box 1.25, 0.01", freeze(1.25, 0.01)},
      {"freeze box 1, 0.01", freeze(1, 0.01)},
      {"freeze box 2.5, 0.1", freeze(2.5, 0.1)},
      {"freeze box 1.25, 0.03", freeze(1.25, 0.03)},
      {"freeze box 1, 0.03", freeze(1, 0.03)},
      {"freeze box 1, 0.1", freeze(1, 0.1)},
      {"freeze box 1, 0.3", freeze(1, 0.3)},
      {"window + freeze",
       [](WheelTestSpec* s) {
         s->rig.scene.bed = SceneBed::kWindow;
         FreezeWith(s, 1.25, 0.01);
       }},
      {"stop at 2 %", [](WheelTestSpec* s) { s->rig.target_relative_error = 0.02; }},
      {"step x0.5", step(0.1)},
      {"step x1.15", step(0.23)},
      {"step x1.5", step(0.3)},
      {"largest step", [](WheelTestSpec* s) { s->rig.scene.largest_step = true; }},
      {"stiffness x4", [](WheelTestSpec* s) { ScaleStiffness(s, 4); }, true},
      {"speed x0.5",
       [](WheelTestSpec* s) {
         s->rig.speed_m_per_s *= 0.5;
         s->rig.max_time_s *= 2;
       }},
      {"reduced, to the end", [](WheelTestSpec* s) { s->rig.scene = ReducedDomain(); }},
      {"reduced",
       [](WheelTestSpec* s) {
         s->rig.scene = ReducedDomain();
         s->rig.target_relative_error = 0.02;
       }},
  };
}

using Results = std::map<std::string, Outcome>;  // by "row|state|seed"

std::string KeyOf(const std::string& row, const std::string& state, int seed) {
  return row + "|" + state + "|" + std::to_string(seed);
}

Results Load(const std::string& file) {
  Results out;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string key;
    Outcome o;
    if (!std::getline(words, key, '\t') || !std::getline(words, o.status, '\t') ||
        !std::getline(words, o.stopped, '\t')) {
      continue;
    }
    for (int k = 0; k < 4; ++k) words >> o.mean[k] >> o.error[k];
    words >> o.steps >> o.particle_steps >> o.active >> o.deep >> o.cpu_s >> o.end_s >> o.p99 >>
        o.residual;
    if (words) out[key] = o;
  }
  return out;
}

void Append(const std::string& file, const std::string& key, const Outcome& o) {
  std::ofstream out(file, std::ios::app);
  out.precision(8);
  out << key << '\t' << o.status << '\t' << o.stopped;
  for (int k = 0; k < 4; ++k) out << '\t' << o.mean[k] << '\t' << o.error[k];
  out << '\t' << o.steps << '\t' << o.particle_steps << '\t' << o.active << '\t' << o.deep << '\t'
      << o.cpu_s << '\t' << o.end_s << '\t' << o.p99 << '\t' << o.residual << std::endl;
}

Outcome RunOne(const WheelTestSpec& spec, const Tile& tile) {
  const std::clock_t begin = std::clock();  // not the wall: the machine may be shared
  const WheelTestResult r = RunWheelTest(spec, tile, nullptr);
  Outcome o;
  o.status = NameOf(r.status);
  if (!r.reason.empty()) o.status += " (" + r.reason + ")";
  o.stopped = Explain(r.stopped);
  for (const OutputMean& m : r.outputs) {
    for (int k = 0; k < 4; ++k) {
      if (m.name != kOutputs[k]) continue;
      o.mean[k] = m.mean;
      o.error[k] = m.standard_error;
    }
  }
  o.steps = static_cast<double>(r.steps);
  o.particle_steps = r.use.particle_steps;
  o.active = r.use.active_particle_steps;
  o.deep = r.use.deep_particle_steps;
  o.cpu_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  o.end_s = r.window_end_s;
  o.p99 = r.overlap_p99_over_radius;
  o.residual = r.energy.input_j > 0 ? std::abs(r.energy.residual_j) / r.energy.input_j : 0;
  return o;
}

/// Mean over seeds, its standard error (scatter over seeds), and the mean of
/// the standard errors that the runs give themselves.
struct Pooled {
  double mean = 0, error = 0, own = 0;
};
Pooled Pool(const std::vector<Outcome>& runs, int output) {
  Pooled p;
  const auto n = static_cast<double>(runs.size());
  for (const Outcome& o : runs) p.mean += o.mean[output] / n, p.own += o.error[output] / n;
  double square = 0;
  for (const Outcome& o : runs) square += std::pow(o.mean[output] - p.mean, 2);
  p.error = n > 1 ? std::sqrt(square / (n - 1) / n) : p.own;
  return p;
}

void PrintTable(const Results& results, const State& state, const Options& o) {
  std::printf("\n### %s: slip %.2g, attack angle %.0f degrees, %.0f N\n\n", state.name.c_str(),
              state.slip, state.attack_deg, state.load_n);
  std::printf(
      "| switch | runs | F_x N | F_y N | torque N m | sinkage mm | own SE F_x, F_y | "
      "steps | particle-steps | active | deep of active | CPU s | full/this | residual | "
      "not steady |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  double full_cpu = 0;
  for (const Row& row : Rows()) {
    std::vector<Outcome> runs;
    int unsteady = 0;
    double steps = 0, cost = 0, active = 0, deep = 0, cpu = 0, residual = 0;
    for (int seed = o.first_seed; seed < o.first_seed + o.seeds; ++seed) {
      const auto found = results.find(KeyOf(row.name, state.name, seed));
      if (found == results.end()) continue;
      const Outcome& run = found->second;
      unsteady += run.status.rfind("steady", 0) != 0;
      runs.push_back(run);
      steps += run.steps, cost += run.particle_steps, active += run.active, deep += run.deep;
      cpu += run.cpu_s, residual = std::max(residual, run.residual);
    }
    if (runs.empty()) continue;
    const auto n = static_cast<double>(runs.size());
    if (row.name == "full") full_cpu = cpu / n;
    std::printf("| %s | %zu |", row.name.c_str(), runs.size());
    for (int k = 0; k < 4; ++k) {
      const Pooled p = Pool(runs, k);
      const double unit = k == 3 ? 1e3 : 1;
      std::printf(" %.*f +- %.*f |", k == 2 ? 4 : 2, p.mean * unit, k == 2 ? 4 : 2, p.error * unit);
    }
    std::printf(" %.2f, %.2f | %.3g | %.3g | %.2f | %.2f | %.1f | %.2f | %.2g | %d |\n",
                Pool(runs, 0).own, Pool(runs, 1).own, steps / n, cost / n, active / cost,
                active > 0 ? deep / active : 0, cpu / n, full_cpu / (cpu / n), residual, unsteady);
  }
}

bool Wanted(const std::string& list, const std::string& name) {
  return list.empty() || (";" + list + ";").find(";" + name + ";") != std::string::npos;
}

void Study(const Options& o, Results* results) {
  for (int seed = o.first_seed; seed < o.first_seed + o.seeds; ++seed) {
    std::map<double, Tile> tiles;  // by stiffness
    for (const State& state : States()) {
      if (!Wanted(o.states, state.name)) continue;
      for (const Row& row : Rows()) {
        const std::string key = KeyOf(row.name, state.name, seed);
        if (!Wanted(o.rows, row.name) || results->count(key)) continue;
        WheelTestSpec spec = FullModel(o, state, seed);
        WheelTestSpec bed = spec;
        row.change(&spec);
        if (row.own_tile) bed = spec;
        const double stiffness = bed.soil.youngs_modulus_pa;
        if (!tiles.count(stiffness)) tiles[stiffness] = PrepareBed(BedOf(bed), nullptr);
        const Outcome outcome = RunOne(spec, tiles[stiffness]);
        Append(o.file, key, outcome);
        (*results)[key] = outcome;
        std::fprintf(stderr, "%s: %s, %s, %.1f s\n", key.c_str(), outcome.status.c_str(),
                     outcome.stopped.c_str(), outcome.cpu_s);
      }
    }
  }
}

Options Parse(int argc, char** argv) {
  Options o;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&]() -> std::string { return ++i < argc ? argv[i] : ""; };
    if (word == "--file")
      o.file = value();
    else if (word == "--seeds")
      o.seeds = std::atoi(value().c_str());
    else if (word == "--first-seed")
      o.first_seed = std::atoi(value().c_str());
    else if (word == "--diameter")
      o.diameter_m = std::atof(value().c_str());
    else if (word == "--time")
      o.max_time_s = std::atof(value().c_str());
    else if (word == "--rows")
      o.rows = value();
    else if (word == "--states")
      o.states = value();
    else if (word == "--table")
      o.table_only = true;
    else {
      std::fprintf(stderr,
                   "usage: grouser-scene-study [--file TSV] [--seeds N] [--first-seed N] "
                   "[--diameter M] [--time S] [--rows 'A;B'] [--states 'A;B'] [--table]\n");
      std::exit(2);
    }
  }
  return o;
}

}  // namespace
}  // namespace grouser::dem

int main(int argc, char** argv) {
  using namespace grouser::dem;
  const Options options = Parse(argc, argv);
  Results results = Load(options.file);
  if (!options.table_only) Study(options, &results);
  for (const State& state : States()) {
    if (Wanted(options.states, state.name)) PrintTable(results, state, options);
  }
  return 0;
}
