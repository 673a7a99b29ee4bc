// An experiment runs into its files.
#include "dem_offline/campaign/experiment_run.h"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "dem_offline/campaign/frame_files.h"
#include "dem_offline/engine/core/byte_archive.h"
#include "dem_offline/engine/rig/wheel_test.h"
#include "proto/records/durable_file.h"
#include "proto/records/model_file.h"
#include "proto/records/run_file.h"

namespace grouser::campaign {
namespace {

namespace dx = dem::experiment;

/// A file that cannot be written: that says nothing about the experiment.
struct FileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// One CSV that grows while a run goes on. What was written is on the disk once a second, and when
/// it is closed. Throws FileError naming the file.
class CsvFile {
 public:
  /// kept: bytes of an earlier one that stay; 0: a new file.
  CsvFile(const std::string& path, const std::vector<std::string>& columns, std::uint64_t kept)
      : path_(path) {
    file_.reset(std::fopen(path.c_str(), kept > 0 ? "ae" : "we"));
    if (!file_) Fail();
    if (kept == 0) Put(fmt::format("{}\n", fmt::join(columns, ",")));
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
  [[noreturn]] void Fail() const { throw FileError(path_ + ": " + std::strerror(errno)); }

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
    if (!csv) csv = std::make_unique<CsvFile>(PathOf(table.name), table.columns, kept_[table.name]);
    csv->Row(row);
    if (table.name != "series") return;
    for (std::size_t k = 0; k < row.size(); ++k) series_[table.columns[k]].push_back(row[k]);
  }
  void Sync() {
    for (auto& [name, csv] : files_) csv->Sync();
  }
  const records::DoubleArrays& series() const { return series_; }

  /// How far the files are, and what the run file will hold of them.
  void Save(dem::ByteWriter& out) {
    Sync();
    for (const auto& [name, csv] : files_) kept_[name] = std::filesystem::file_size(PathOf(name));
    out(static_cast<std::uint64_t>(kept_.size()));
    for (const auto& [name, bytes] : kept_) out(name), out(bytes);
    out(static_cast<std::uint64_t>(series_.size()));
    for (const auto& [name, values] : series_) out(name), out(values);
  }
  /// Cuts off what was written after it.
  void Load(dem::ByteReader& in) {
    std::uint64_t files = 0, columns = 0;
    std::string name;
    in(files);
    for (std::uint64_t k = 0; k < files; ++k) {
      in(name);
      in(kept_[name]);
      std::error_code error;
      const std::uint64_t size = std::filesystem::file_size(PathOf(name), error);
      if (error || size < kept_[name]) {
        throw InputError(PathOf(name) +
                         ": missing or shorter than at the checkpoint; without "
                         "--resume the run begins anew");
      }
      std::filesystem::resize_file(PathOf(name), kept_[name]);
    }
    in(columns);
    for (std::uint64_t k = 0; k < columns; ++k) {
      in(name);
      in(series_[name]);
    }
  }

 private:
  std::string PathOf(const std::string& table) const { return stem_ + "." + table + ".csv"; }

  std::string stem_;
  std::map<std::string, std::unique_ptr<CsvFile>> files_;
  std::map<std::string, std::uint64_t> kept_;  ///< bytes that were there at the checkpoint
  records::DoubleArrays series_;
};

void FillRecord(const ExperimentFile& file, const dx::Result& result, v1alpha1::RunRecord* r) {
  auto* spec = r->mutable_experiment_spec();
  spec->set_name(file.experiment.name);
  spec->set_yaml(file.text);
  for (const std::string& set : file.sets) spec->add_sets(set);
  for (const NamedFile& other : file.others) {
    spec->add_others(records::Sha256OfFile(other.path) + " " + Described(other));
  }
  r->set_run_id(RunIdOf(file));
  r->set_status(result.done ? v1alpha1::RUN_STATUS_DONE : v1alpha1::RUN_STATUS_FAILED);
  r->set_reason(result.reason);
  auto* bed = r->mutable_bed();
  bed->set_grains(result.grains);
  bed->set_solid_fraction(result.solid_fraction);
  bed->set_top_solid_fraction(result.top_solid_fraction);
  bed->set_coordination(result.coordination);
  const auto& [under, top] = result.packed_with;
  bed->set_preparation_friction(under.friction);
  bed->set_preparation_rolling_friction(under.rolling_friction);
  bed->set_top_preparation_friction(top.friction);
  bed->set_top_preparation_rolling_friction(top.rolling_friction);
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

/// Does it, and throws FileError for what it throws.
template <class F>
void Writing(F&& f) {
  try {
    f();
  } catch (const std::runtime_error& error) {
    throw FileError(error.what());
  }
}

constexpr char kCheckpointMagic[] = "grouser checkpoint 1\n";

/// Run, tables, times of frames, and the state of the engine; then the hash of all that.
void WriteCheckpoint(const std::string& path, const std::string& run_id, const std::string& engine,
                     Tables* tables, const FrameFiles& frames) {
  dem::ByteWriter out;
  out(std::string(kCheckpointMagic));
  out(run_id);
  tables->Save(out);
  out(frames.times_s());
  out(engine);
  records::WriteFileDurably(path, out.bytes() + records::Sha256OfString(out.bytes()));
}

/// The state of the engine; tables and frames are put back to where they were.
std::string ReadCheckpoint(const std::string& path, const std::string& run_id, Tables* tables,
                           FrameFiles* frames) {
  constexpr std::size_t kHash = 64;
  std::string bytes = records::ReadFileBytes(path), text;
  const std::string hash = bytes.substr(bytes.size() - std::min(bytes.size(), kHash));
  bytes.resize(bytes.size() - hash.size());
  if (records::Sha256OfString(bytes) != hash) {
    throw InputError(path + ": damaged, expected a checkpoint as it was written");
  }
  dem::ByteReader in(std::move(bytes));
  in(text);
  if (text != kCheckpointMagic) throw InputError(path + ": no checkpoint of this version");
  in(text);
  if (text != run_id) {
    throw InputError(
        fmt::format("{}: of run {}, not {}: the experiment or the engine has changed; "
                    "without --resume the run begins anew",
                    path, text, run_id));
  }
  tables->Load(in);
  std::vector<double> times;
  in(times);
  frames->SetTimes(std::move(times));
  in(text);
  return text;
}

}  // namespace

std::string StemOf(const std::string& out) {
  constexpr std::string_view kEnding = ".run.h5";
  return out.ends_with(kEnding) ? out.substr(0, out.size() - kEnding.size()) : out;
}

std::string RunIdOf(const ExperimentFile& file) {
  std::string all = std::string("engine ") + dem::EngineVersion() + "\n" + file.resolved;
  for (const NamedFile& other : file.others) all += "\n" + records::Sha256OfFile(other.path);
  return records::Sha256OfString(all).substr(0, 16);
}

std::string CheckpointOf(const std::string& out) { return StemOf(out) + ".checkpoint"; }

std::optional<records::RunFile> RunExperimentTo(const std::string& out,
                                                const ExperimentFile& experiment,
                                                const RunOptions& options) {
  Tables tables(out);
  FrameFiles frames(StemOf(out) + ".frames");
  const std::string id = RunIdOf(experiment), checkpoint = CheckpointOf(out);
  bool stopped = false;
  const auto sink = [&](const dx::Table& table, const std::vector<double>& row) {
    tables.Take(table, row);
  };
  const auto progress = [&](double fraction, const std::string&) {
    stopped = stopped || !options.told(fraction);
    return !stopped;
  };
  dx::RunExtras extras;
  extras.frame = [&](const dx::Snapshot& s) { Writing([&] { frames.Write(s); }); };
  extras.checkpoint = [&](const std::string& bytes) {
    Writing([&] { WriteCheckpoint(checkpoint, id, bytes, &tables, frames); });
  };
  if (options.resume && std::filesystem::exists(checkpoint)) {
    extras.resume = ReadCheckpoint(checkpoint, id, &tables, &frames);
  }
  dx::Result result;
  try {
    result = dx::RunExperiment(experiment.experiment, sink, progress, options.limits, extras);
  } catch (const FileError&) {
    throw;
  } catch (const dem::SpecError& error) {
    if (options.on_failure == OnFailure::kThrow) throw;
    result.reason =
        fmt::format("{}: got {}, expected {}", error.field(), error.got(), error.expected());
  } catch (const std::runtime_error& error) {
    tables.Sync();
    if (stopped) return std::nullopt;
    if (options.on_failure == OnFailure::kThrow) throw;
    result.reason = error.what();
  }
  tables.Sync();
  records::RunFile run;
  FillRecord(experiment, result, &run.record);
  run.series = tables.series();
  records::WriteRunFile(out, run);
  std::error_code ignored;
  std::filesystem::remove(checkpoint, ignored);
  return run;
}

}  // namespace grouser::campaign
