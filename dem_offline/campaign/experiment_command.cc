// Experiment files: what they take, what they may hold, and their run.
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <memory>

#include "dem_offline/campaign/commands.h"
#include "dem_offline/campaign/progress.h"
#include "dem_offline/engine/experiment/experiment.h"
#include "dem_offline/engine/rig/wheel_test.h"
#include "dem_offline/scenes/experiment_keys.h"
#include "dem_offline/scenes/experiment_yaml.h"
#include "proto/records/run_file.h"

namespace grouser::campaign {
namespace {

namespace dx = dem::experiment;

constexpr char kCheckExamples[] = R"(Example:
  grouser-dem check dem_offline/experiments/plate.yaml
Exit codes: 0 it can be run, 2 it cannot (FILE:LINE: key: what was got and expected).)";
constexpr char kSchemaExamples[] = R"(Examples:
  grouser-dem schema > experiment.schema.json     # JSON Schema, for editors
  grouser-dem schema --table                      # the table of docs/experiments.md)";

/// One CSV that grows while a run goes on. What was written is on the disk once a second, and when
/// it is closed. Throws std::runtime_error naming the file.
class CsvFile {
 public:
  CsvFile(const std::string& path, const std::vector<std::string>& columns) : path_(path) {
    file_.reset(std::fopen(path.c_str(), "we"));
    if (!file_) Fail();
    Put(fmt::format("{}\n", fmt::join(columns, ",")));
  }
  void Row(const std::vector<double>& row) {
    std::string text;
    for (const double v : row) text += fmt::format("{}{:.9g}", text.empty() ? "" : ",", v);
    Put(text + "\n");
    const auto now = std::chrono::steady_clock::now();
    if (now - synced_ < std::chrono::seconds(1)) return;
    synced_ = now;
    Sync();
  }
  void Sync() {
    if (std::fflush(file_.get()) != 0 || fsync(fileno(file_.get())) != 0) Fail();
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void Put(const std::string& text) {
    if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size()) Fail();
  }
  [[noreturn]] void Fail() const { throw std::runtime_error(path_ + ": " + std::strerror(errno)); }

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::chrono::steady_clock::time_point synced_{};
};

/// OUT without .run.h5.
std::string StemOf(const std::string& out) {
  constexpr std::string_view kEnding = ".run.h5";
  return out.ends_with(kEnding) ? out.substr(0, out.size() - kEnding.size()) : out;
}

/// CSVs of all tables, and the series for the run file.
class Tables {
 public:
  explicit Tables(const std::string& out) : stem_(StemOf(out)) {}
  void Take(const dx::Table& table, const std::vector<double>& row) {
    auto& csv = files_[table.name];
    if (!csv) csv = std::make_unique<CsvFile>(stem_ + "." + table.name + ".csv", table.columns);
    csv->Row(row);
    if (table.name != "series") return;
    for (std::size_t k = 0; k < row.size(); ++k) series_[table.columns[k]].push_back(row[k]);
  }
  void Sync() {
    for (auto& [name, csv] : files_) csv->Sync();
  }
  const records::DoubleArrays& series() const { return series_; }

 private:
  std::string stem_;
  std::map<std::string, std::unique_ptr<CsvFile>> files_;
  records::DoubleArrays series_;
};

void FillRecord(const ExperimentFile& file, const dx::Result& result, v1alpha1::RunRecord* r) {
  auto* spec = r->mutable_experiment_spec();
  spec->set_name(file.experiment.name);
  spec->set_yaml(file.text);
  std::string all = std::string("engine ") + dem::EngineVersion() + "\n" + file.text;
  for (const std::string& set : file.sets) {
    spec->add_sets(set);
    all += "\n" + set;
  }
  for (const std::string& other : file.others) {
    const std::string hash = records::Sha256OfFile(other);
    spec->add_others(hash + " " + std::filesystem::path(other).filename().string());
    all += "\n" + hash;
  }
  r->set_run_id(records::Sha256OfString(all).substr(0, 16));
  r->set_status(result.done ? v1alpha1::RUN_STATUS_DONE : v1alpha1::RUN_STATUS_FAILED);
  r->set_reason(result.reason);
  auto* bed = r->mutable_bed();
  bed->set_grains(result.grains);
  bed->set_solid_fraction(result.solid_fraction);
  bed->set_coordination(result.coordination);
  auto* n = r->mutable_numerics();
  n->set_dt_s(result.dt_s);
  n->set_steps(result.steps);
  n->set_rayleigh_time_s(result.rayleigh_time_s);
  n->set_particle_steps(result.particle_steps);
  n->set_wall_s(result.wall_s);
  n->set_quantum_m(result.quantum_m);
  n->set_list_rebuilds(result.list_rebuilds);
  n->set_overlap_p99_over_radius(result.overlap_p99);
  n->set_overlap_max_over_radius(result.overlap_max);
  n->set_engine_version(dem::EngineVersion());
  n->set_isa(dem::EngineIsa());
  r->mutable_energy()->set_input_j(result.energy_input_j);
  r->mutable_energy()->set_residual_j(result.energy_residual_j);
  r->set_created_unix_s(
      std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count());
}

int Check(const std::string& path, const dem::WorkLimits& limits,
          const std::vector<std::string>& sets) {
  const ExperimentFile file = LoadExperiment(path, limits, sets);
  const dx::Plan plan = dx::PlanOf(file.experiment, limits);
  const double rate = dx::MeasureRate(file.experiment);
  fmt::print("experiment   {}\n", file.experiment.name);
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

bool RunExperimentFile(const std::string& file, const std::string& out,
                       const std::vector<std::string>& sets, const dem::WorkLimits& limits,
                       const ToldFn& told, v1alpha1::RunRecord* record) {
  const ExperimentFile experiment = LoadExperiment(file, limits, sets);
  Tables tables(out);
  bool stopped = false;
  const auto sink = [&](const dx::Table& table, const std::vector<double>& row) {
    tables.Take(table, row);
  };
  const auto progress = [&](double fraction, const std::string&) {
    stopped = stopped || !told(fraction);
    return !stopped;
  };
  dx::Result result;
  try {
    result = dx::RunExperiment(experiment.experiment, sink, progress, limits);
  } catch (const std::runtime_error&) {
    tables.Sync();
    if (stopped) return false;
    throw;
  }
  tables.Sync();
  records::RunFile run;
  FillRecord(experiment, result, &run.record);
  run.series = tables.series();
  records::WriteRunFile(out, run);
  *record = run.record;
  return true;
}

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
