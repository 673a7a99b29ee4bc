// Experiment files: what they take, and what they may hold.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <thread>

#include "dem_offline/campaign/commands.h"
#include "dem_offline/campaign/progress.h"
#include "dem_offline/engine/experiment/probes.h"
#include "dem_offline/scenes/experiment_keys.h"
#include "dem_offline/scenes/sweep_yaml.h"

namespace grouser::campaign {
namespace {

namespace dx = dem::experiment;

constexpr char kCheckExamples[] = R"(Example:
  grouser-dem check dem_offline/experiments/plate.yaml
Exit codes: 0 it can be run, 2 it cannot (FILE:LINE: key: what was got and expected).)";
constexpr char kSchemaExamples[] = R"(Examples:
  grouser-dem schema > experiment.schema.json     # JSON Schema, for editors
  grouser-dem schema --table                      # the table of docs/experiments.md)";

void PrintMeshes(const ExperimentFile& file) {
  for (const NamedFile& other : file.others) {
    if (!other.note.empty()) fmt::print("mesh         {}\n", Described(other));
  }
}

/// All members are read; the speed and the meshes are those of the first.
int CheckSweep(const Sweep& sweep, const dem::WorkLimits& limits) {
  double rate = 0, all = 0, longest = 0, bytes = 0, grains = 0;
  for (const SweepMember& member : sweep.members) {
    const ExperimentFile file = ReadMember(sweep, member, limits);
    if (rate == 0) PrintMeshes(file);
    CheckResults(sweep, dx::SeriesColumns(file.experiment));
    const dx::Plan plan = dx::PlanOf(file.experiment, limits);
    if (rate == 0) rate = dx::MeasureRate(file.experiment);
    const double work = plan.preparation_grain_steps + plan.program_grain_steps;
    all += work;
    longest = std::max(longest, work);
    bytes = std::max(bytes, plan.work.bytes);
    grains = std::max(grains, plan.work.grains);
  }
  const auto held_out = std::count_if(sweep.members.begin(), sweep.members.end(),
                                      [](const SweepMember& m) { return m.held_out; });
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  fmt::print("sweep        {}\n", sweep.name);
  fmt::print("members      {}, {} of them held out\n", sweep.members.size(), held_out);
  fmt::print("grains       {:.0f} at most\n", grains);
  fmt::print("memory       {:.0f} MiB at most, each run\n", bytes / 1048576.0);
  fmt::print("speed here   {:.3g} grain-steps/s, one core\n", rate);
  fmt::print("time         {} together on one core, {} on {}; longest member {}, at most\n",
             ForPeople(all / rate), ForPeople(std::max(longest, all / cores) / rate), cores,
             ForPeople(longest / rate));
  return 0;
}

int Check(const std::string& path, const dem::WorkLimits& limits,
          const std::vector<std::string>& sets) {
  if (const auto sweep = LoadSweep(path, sets)) return CheckSweep(*sweep, limits);
  const ExperimentFile file = LoadExperiment(path, limits, sets);
  const dx::Plan plan = dx::PlanOf(file.experiment, limits);
  const double rate = dx::MeasureRate(file.experiment);
  fmt::print("experiment   {}\n", file.experiment.name);
  PrintMeshes(file);
  fmt::print("grains       {:.0f} at most\n", plan.work.grains);
  fmt::print("time step    {:.4g} s ({:.3g} of the Rayleigh time)\n", plan.dt_s,
             plan.dt_s / plan.rayleigh_time_s);
  fmt::print("simulated    preparation {:.3g} s, program {:.3g} s, at most\n", plan.preparation_s,
             plan.program_s);
  fmt::print("steps        {:.3g} at most\n", plan.work.steps);
  fmt::print("memory       {:.0f} MiB at most\n", plan.work.bytes / 1048576.0);
  fmt::print("speed here   {:.3g} grain-steps/s, one core\n", rate);
  fmt::print("time         preparation {}, program {}, at most\n",
             ForPeople(plan.preparation_grain_steps / rate),
             ForPeople(plan.program_grain_steps / rate));
  return 0;
}

}  // namespace

CLI::Option* AddSets(CLI::App& command, std::vector<std::string>* sets) {
  return command.add_option("--set", *sets, "KEY=VALUE over the file, as grains.diameter_m=0.01")
      ->take_all()
      ->allow_extra_args(false);
}

void AddExperimentCommands(CLI::App& app, Action* action) {
  struct Arguments {
    std::string file;
    std::vector<std::string> sets;
    bool table = false;
    dem::WorkLimits limits;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* check = app.add_subcommand("check", "What an experiment file takes, before it is run");
  check->footer(kCheckExamples);
  check->add_option("FILE", arguments->file, "An experiment file")->required();
  AddSets(*check, &arguments->sets);
  AddMemoryLimit(*check, &arguments->limits);
  check->callback([=] {
    *action = [=](const StopSignals&) {
      return Check(arguments->file, arguments->limits, arguments->sets);
    };
  });
  CLI::App* schema = app.add_subcommand("schema", "Every key of an experiment file");
  schema->footer(kSchemaExamples);
  schema->add_flag("--table", arguments->table, "As Markdown, for people");
  schema->callback([=] {
    *action = [=](const StopSignals&) {
      fmt::print("{}", arguments->table ? ExperimentKeyTable() : ExperimentSchema());
      return 0;
    };
  });
}

}  // namespace grouser::campaign
