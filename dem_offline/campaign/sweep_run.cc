// Members of a sweep run on the cores, and their table.
#include "dem_offline/campaign/sweep_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <list>
#include <map>
#include <mutex>

#include "dem_offline/campaign/experiment_run.h"
#include "dem_offline/campaign/run_folder.h"
#include "dem_offline/campaign/workers.h"
#include "dem_offline/engine/experiment/probes.h"
#include "proto/records/durable_file.h"
#include "proto/records/model_file.h"
#include "proto/records/os/regular_file.h"

namespace grouser::campaign {
namespace {

namespace dx = dem::experiment;

struct Task {
  const SweepMember* member;
  std::size_t row;
  std::string run_id;
  double grain_steps = 0, bytes = 0;
};

std::string Quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::string StatusWord(v1alpha1::RunStatus status) {
  return v1alpha1::RunStatus_Name(status).substr(sizeof("RUN_STATUS_") - 1);
}

/// members.csv, a row for every member in the order of the file. Thread-safe.
class MemberTable {
 public:
  MemberTable(const Sweep& sweep, std::string path) : sweep_(sweep), path_(std::move(path)) {
    std::vector<std::string> names = {"member", "run_id", "role"};
    for (const std::string& key : sweep.keys) names.push_back(Quoted(key));
    names.insert(names.end(), {"seed", "status"});
    for (const SweepResult& r : sweep.results) names.push_back(r.name);
    names.push_back("reason");
    header_ = fmt::format("{}\n", fmt::join(names, ","));
    for (std::size_t k = 0; k < sweep.members.size(); ++k) {
      const SweepMember& m = sweep.members[k];
      std::vector<std::string> cells = {std::to_string(k), "",
                                        m.held_out ? "held_out" : "training"};
      for (const std::string& value : m.values) cells.push_back(Quoted(value));
      cells.insert(cells.end(), {std::to_string(m.seed), "PLANNED"});
      cells.resize(cells.size() + sweep.results.size() + 1);
      rows_.push_back(std::move(cells));
    }
  }
  void SetId(std::size_t row, const std::string& run_id) { rows_[row][1] = run_id; }
  void Put(std::size_t row, const records::RunFile& run) {
    const std::lock_guard lock(mutex_);
    std::vector<std::string>& cells = rows_[row];
    const std::size_t status = cells.size() - sweep_.results.size() - 2;
    cells[status] = StatusWord(run.record.status());
    for (std::size_t k = 0; k < sweep_.results.size() && !run.series.empty(); ++k) {
      cells[status + 1 + k] = fmt::format("{:.9g}", ValueOf(sweep_.results[k], run.series));
    }
    cells.back() = Quoted(run.record.reason());
  }
  void Write() {
    const std::lock_guard lock(mutex_);
    std::string text = header_;
    for (const auto& cells : rows_) text += fmt::format("{}\n", fmt::join(cells, ","));
    records::WriteFileDurably(path_, text);
  }

 private:
  const Sweep& sweep_;
  std::string path_, header_;
  std::mutex mutex_;  // rows_
  std::vector<std::vector<std::string>> rows_;
};

/// Every member is read and planned before the first one runs.
std::list<Task> PlanTasks(const Sweep& sweep, const dem::WorkLimits& limits, MemberTable* table) {
  std::list<Task> tasks;
  std::map<std::string, std::size_t> row_of;
  for (std::size_t k = 0; k < sweep.members.size(); ++k) {
    const ExperimentFile file = ReadMember(sweep, sweep.members[k], limits);
    CheckResults(sweep, dx::SeriesColumns(file.experiment));
    const dx::Plan plan = dx::PlanOf(file.experiment, limits);
    tasks.push_back({&sweep.members[k], k, RunIdOf(file),
                     plan.preparation_grain_steps + plan.program_grain_steps, plan.work.bytes});
    const auto [twin, first] = row_of.try_emplace(tasks.back().run_id, k);
    if (!first) {
      throw InputError(
          fmt::format("{}: sweep: members {} and {} are the same ({}), expected each "
                      "once",
                      sweep.file, twin->second, k, Describe(sweep, sweep.members[k])));
    }
    table->SetId(k, tasks.back().run_id);
  }
  return tasks;
}

/// A run that is there already; nothing: it has to be run (again).
std::optional<records::RunFile> FinishedRun(const std::string& path, const std::string& id,
                                            CampaignProgress& progress) {
  if (!std::filesystem::exists(path)) return std::nullopt;
  std::string why;
  try {
    records::RunFile run = records::ReadAnyRunFile(path);
    if (run.record.run_id() == id) return run;
    why = fmt::format("{}: holds run {}", path, run.record.run_id());
  } catch (const std::exception& error) {
    why = error.what();
  }
  progress.Say(fmt::format("{}; set aside as {}, running {} again", why, os::SetAside(path), id));
  return std::nullopt;
}

class SweepExecutor {
 public:
  SweepExecutor(const Sweep& sweep, const SweepOptions& options, const RunFolder& folder,
                const std::atomic<bool>& stop, CampaignProgress& progress, MemberTable& table,
                std::list<Task> tasks)
      : sweep_(sweep),
        limits_(options.limits),
        folder_(folder),
        workers_(stop),
        progress_(progress),
        table_(table),
        tasks_(std::move(tasks)) {}

  void Run(int jobs) {
    workers_.Run(jobs, [this] { return One(); });
  }

 private:
  bool One() {
    Task task;
    {
      const std::lock_guard lock(mutex_);
      if (tasks_.empty()) return false;
      task = std::move(tasks_.front());
      tasks_.pop_front();
    }
    const auto run = RunMember(task);
    if (!run) return false;
    table_.Put(task.row, *run);
    progress_.Finished(task.run_id, Describe(sweep_, *task.member), run->record);
    table_.Write();
    return true;
  }

  std::optional<records::RunFile> RunMember(const Task& task) {
    const ExperimentFile file = ReadMember(sweep_, *task.member, limits_);
    const std::string out = folder_.RunPath(task.run_id);
    const auto told = [&](double fraction) {
      progress_.Working(task.run_id, fraction, "run");
      return !workers_.Stopping();
    };
    return RunExperimentTo(out, file, {limits_, told, OnFailure::kRecord, /*resume=*/true});
  }

  const Sweep& sweep_;
  const dem::WorkLimits& limits_;
  const RunFolder& folder_;
  Workers workers_;
  CampaignProgress& progress_;
  MemberTable& table_;
  std::mutex mutex_;  // tasks_
  std::list<Task> tasks_;
};

/// A folder holds one sweep, whose values may change.
void ClaimFolder(const RunFolder& folder, const Sweep& sweep) {
  folder.RemoveTemporaries();
  const std::string path = folder.path() + "/experiment.yaml";
  std::string before;
  if (folder.HasCampaign()) before = folder.ReadCampaign().name();
  if (std::filesystem::exists(path)) before = YamlSection::Load(path).Text("name");
  if (!before.empty() && before != sweep.name) {
    throw InputError(fmt::format("{}: holds '{}', not '{}'; choose another --out", folder.path(),
                                 before, sweep.name));
  }
  records::WriteFileDurably(path, sweep.text);
}

}  // namespace

v1alpha1::CampaignStatus RunSweep(const Sweep& sweep, const SweepOptions& options,
                                  const std::atomic<bool>& stop, CampaignProgress& progress) {
  MemberTable table(sweep, options.folder + "/members.csv");
  std::list<Task> tasks = PlanTasks(sweep, options.limits, &table);
  const RunFolder folder(options.folder);
  folder.Create(/*tiles=*/false);
  const os::UniqueFd lock = folder.Lock();
  ClaimFolder(folder, sweep);
  std::vector<v1alpha1::RunStatus> finished;
  tasks.remove_if([&](const Task& task) {
    const auto run = FinishedRun(folder.RunPath(task.run_id), task.run_id, progress);
    if (run) table.Put(task.row, *run);
    if (run) finished.push_back(run->record.status());
    return run.has_value();
  });
  tasks.sort([](const Task& a, const Task& b) { return a.grain_steps > b.grain_steps; });
  table.Write();
  progress.Start(sweep.name, static_cast<int>(sweep.members.size()),
                 static_cast<int>(finished.size()));
  for (const auto status : finished) progress.Resumed(status);
  double largest = 0;
  for (const Task& task : tasks) largest = std::max(largest, task.bytes);
  const int jobs =
      JobsThatFit(static_cast<int>(tasks.size()), options.jobs, largest, options.limits, progress);
  SweepExecutor(sweep, options, folder, stop, progress, table, std::move(tasks)).Run(jobs);
  table.Write();
  return progress.Status();
}

}  // namespace grouser::campaign
