// An experiment runs into its files.
#include "dem_offline/campaign/experiment_run.h"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <filesystem>
#include <memory>
#include <system_error>

#include "dem_offline/engine/rig/wheel_test.h"
#include "proto/records/run_file.h"

namespace grouser::campaign {
namespace {

namespace dx = dem::experiment;

/// One CSV that grows while a run goes on. What was written is on the disk once a second, and when
/// it is closed. Throws std::system_error naming the file.
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
  [[noreturn]] void Fail() const {
    throw std::system_error(errno, std::generic_category(), path_);
  }

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::chrono::steady_clock::time_point synced_{};
};

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
  for (const std::string& set : file.sets) spec->add_sets(set);
  for (const std::string& other : file.others) {
    spec->add_others(records::Sha256OfFile(other) + " " +
                     std::filesystem::path(other).filename().string());
  }
  r->set_run_id(RunIdOf(file));
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
  *r->mutable_create_time() = google::protobuf::util::TimeUtil::GetCurrentTime();
}

}  // namespace

std::string StemOf(const std::string& out) {
  constexpr std::string_view kEnding = ".run.h5";
  return out.ends_with(kEnding) ? out.substr(0, out.size() - kEnding.size()) : out;
}

std::string RunIdOf(const ExperimentFile& file) {
  std::string all = std::string("engine ") + dem::EngineVersion() + "\n" + file.resolved;
  for (const std::string& other : file.others) all += "\n" + records::Sha256OfFile(other);
  return records::Sha256OfString(all).substr(0, 16);
}

std::optional<records::RunFile> RunExperimentTo(const std::string& out,
                                                const ExperimentFile& experiment,
                                                const dem::WorkLimits& limits, const ToldFn& told,
                                                OnFailure on_failure) {
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
  } catch (const std::system_error&) {  // a full disk says nothing about the experiment
    throw;
  } catch (const dem::SpecError& error) {
    if (on_failure == OnFailure::kThrow) throw;
    result.reason = fmt::format("{}: got {}, expected {}", error.field(), error.got(),
                                error.expected());
  } catch (const std::runtime_error& error) {
    tables.Sync();
    if (stopped) return std::nullopt;
    if (on_failure == OnFailure::kThrow) throw;
    result.reason = error.what();
  }
  tables.Sync();
  records::RunFile run;
  FillRecord(experiment, result, &run.record);
  run.series = tables.series();
  records::WriteRunFile(out, run);
  return run;
}

}  // namespace grouser::campaign
