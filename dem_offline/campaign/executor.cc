#include "dem_offline/campaign/executor.h"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <filesystem>
#include <list>
#include <mutex>
#include <optional>
#include <set>
#include <vector>

#include "dem_offline/campaign/design.h"
#include "dem_offline/campaign/run_folder.h"
#include "dem_offline/campaign/run_index.h"
#include "dem_offline/campaign/run_one.h"
#include "dem_offline/campaign/schedule.h"
#include "dem_offline/campaign/tile_store.h"
#include "dem_offline/campaign/workers.h"
#include "dem_offline/scenes/engine_convert.h"
#include "dem_offline/scenes/run_identity.h"
#include "dem_offline/scenes/yaml_section.h"
#include "proto/records/os/regular_file.h"
#include "proto/records/run_file.h"

namespace grouser::campaign {
namespace {

struct Task {
  v1alpha1::PlannedRun run;
  v1alpha1::WheelTestSpec spec;
  std::string tile_key;
};

/// Hands out tasks in order, but passes over those whose tile another worker
/// is settling just now, as long as there are others.
class TaskQueue {
 public:
  explicit TaskQueue(std::list<Task> tasks) : tasks_(std::move(tasks)) {}

  std::optional<Task> Next() {
    std::unique_lock lock(mutex_);
    while (!closed_ && !tasks_.empty()) {
      for (auto task = tasks_.begin(); task != tasks_.end(); ++task) {
        if (settling_.count(task->tile_key)) continue;
        if (!settled_.count(task->tile_key)) settling_.insert(task->tile_key);
        Task taken = std::move(*task);
        tasks_.erase(task);
        return taken;
      }
      changed_.wait(lock);
    }
    return std::nullopt;
  }

  void TileReady(const std::string& key) {
    const std::lock_guard lock(mutex_);
    settling_.erase(key);
    settled_.insert(key);
    changed_.notify_all();
  }

  void Close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::list<Task> tasks_;
  std::set<std::string> settling_, settled_;
  bool closed_ = false;
};

class Executor {
 public:
  Executor(const RunFolder& folder, const Backend& backend, const std::atomic<bool>& stop,
           CampaignProgress& progress, std::list<Task> tasks)
      : folder_(folder),
        backend_(backend),
        workers_(stop),
        progress_(progress),
        tiles_(folder.TileFolder(), &backend),
        index_(folder),
        queue_(std::move(tasks)) {}

  void Run(int jobs) {
    // Whatever ends a worker (no task, stop, error) ends the others too.
    workers_.Run(
        jobs, [this] { return One(); }, [this] { queue_.Close(); });
    if (backend_.run_many && !workers_.Stopping()) RunTogether();
  }

 private:
  bool One() {
    const auto task = queue_.Next();
    if (!task || workers_.Stopping()) return false;
    try {
      Do(*task);
    } catch (const Stopped&) {
      return false;
    }
    return true;
  }

  void Do(const Task& task) {
    const std::string& id = task.run.run_id();
    const auto watch = [&](const char* stage) {
      return [this, &id, stage](double fraction, const std::string&) {
        progress_.Working(id, fraction, stage);
        return !workers_.Stopping();
      };
    };
    const auto tile = tiles_.Get(task.spec, watch("tile"));
    queue_.TileReady(task.tile_key);
    if (backend_.run_many) {
      const std::lock_guard lock(mutex_);
      together_.push_back({task, tile});
      return;
    }
    const auto file = RunOnTile(backend_, task.spec, *tile, watch("run"));
    if (file) Keep(task, *file);
  }

  void Keep(const Task& task, const records::RunFile& file) {
    const std::string path = folder_.RunPath(task.run.run_id());
    records::WriteRunFile(path, file);
    {
      const std::lock_guard lock(mutex_);
      index_.Put(IndexRunFile(path));
    }
    progress_.Finished(task.run, file.record);
  }

  /// On a device: all runs whose tiles are settled, side by side.
  void RunTogether() {
    std::vector<dem::gpu::WheelJob> jobs;
    for (const auto& [task, tile] : together_) jobs.push_back({ToEngine(task.spec), &tile->tile});
    if (jobs.empty()) return;
    double finished = 0, under_way = 0;  // runs' worth
    const auto tell = [&](double work) {
      under_way = std::max(0.0, work);
      progress_.Working("device", under_way, "run");
    };
    const auto all = static_cast<double>(jobs.size());
    backend_.run_many(
        jobs,
        [&](double fraction, const std::string& stage) {
          if (stage.rfind(dem::gpu::kMemoryStage, 0) == 0) progress_.Say(stage);
          tell(fraction * all - finished);
          return !workers_.Stopping();
        },
        [&](std::size_t n, const dem::WheelTestResult& result) {
          // What was cut short is no result.
          if (result.stopped == dem::StopCause::kCaller) return;
          ++finished;
          tell(under_way - 1);
          const auto& [task, tile] = together_[n];
          Keep(task, FileOf(backend_, task.spec, *tile, result));
        });
  }

  const RunFolder& folder_;
  const Backend& backend_;
  Workers workers_;
  CampaignProgress& progress_;
  TileStore tiles_;
  RunIndex index_;
  TaskQueue queue_;
  std::mutex mutex_;  // index_, together_
  std::vector<std::pair<Task, std::shared_ptr<const StoredTile>>> together_;
};

std::list<Task> PlanTasks(const v1alpha1::Campaign& campaign, const Backend& backend) {
  std::list<Task> tasks;
  for (const int i : ScheduleOrder(campaign)) {
    const v1alpha1::PlannedRun& run = campaign.runs(i);
    Task task{run, SpecOf(campaign, run), ""};
    task.tile_key = TileKey(task.spec, backend.engine_version);
    try {
      backend.validate(ToEngine(task.spec));
    } catch (const std::invalid_argument& error) {
      throw InputError(fmt::format("campaign '{}', run ({}): {}", campaign.name(),
                                   Describe(run.state(), run.seed()), error.what()));
    }
    tasks.push_back(std::move(task));
  }
  return tasks;
}

/// The most memory that one of the runs needs [bytes].
double LargestOf(const std::list<Task>& tasks) {
  double largest = 0;
  for (const Task& task : tasks) {
    const dem::WheelTestSpec spec = ToEngine(task.spec);
    largest = std::max({largest, dem::WorkOf(spec).bytes, dem::WorkOf(dem::BedOf(spec)).bytes});
  }
  return largest;
}

// The status of a finished run; nothing if it has to be run (again).
std::optional<v1alpha1::RunStatus> FinishedStatus(const RunFolder& folder, const std::string& id,
                                                  CampaignProgress& progress) {
  const std::string path = folder.RunPath(id);
  if (!std::filesystem::exists(path)) return std::nullopt;
  try {
    const auto record = records::ReadRunFile(path).record;
    if (record.run_id() == id) return record.status();
    // DEM takes minutes, and a rename cannot replace a folder: done before, not after.
    progress.Say(fmt::format("{}: holds run {}; set aside as {}, running {} again", path,
                             record.run_id(), os::SetAside(path), id));
  } catch (const std::exception& error) {
    progress.Say(
        fmt::format("{}; set aside as {}, running it again", error.what(), os::SetAside(path)));
  }
  return std::nullopt;
}

void ClaimFolder(const RunFolder& folder, const v1alpha1::Campaign& campaign) {
  folder.RemoveTemporaries();
  if (folder.HasCampaign()) {
    const std::string before = folder.ReadCampaign().name();
    if (before != campaign.name()) {
      throw InputError(fmt::format("{}: holds campaign '{}', not '{}'; choose another --out",
                                   folder.path(), before, campaign.name()));
    }
  }
  folder.WriteCampaign(campaign);
}

}  // namespace

void CheckCampaign(const v1alpha1::Campaign& campaign, const Backend& backend) {
  PlanTasks(campaign, backend);
}

v1alpha1::CampaignStatus RunCampaign(const v1alpha1::Campaign& campaign,
                                     const ExecutorOptions& options, const Backend& backend,
                                     const std::atomic<bool>& stop, CampaignProgress& progress) {
  std::list<Task> tasks = PlanTasks(campaign, backend);
  const RunFolder folder(options.folder);
  folder.Create();
  const os::UniqueFd lock = folder.Lock();
  ClaimFolder(folder, campaign);
  std::vector<v1alpha1::RunStatus> finished;
  tasks.remove_if([&](const Task& task) {
    const auto known = options.known.find(task.run.run_id());
    const auto status = known != options.known.end()
                            ? std::optional(known->second)
                            : FinishedStatus(folder, task.run.run_id(), progress);
    if (status) finished.push_back(*status);
    return status.has_value();
  });
  progress.Start(campaign.name(), campaign.runs_size(), static_cast<int>(finished.size()));
  for (const auto status : finished) progress.Resumed(status);
  const int jobs = JobsThatFit(static_cast<int>(tasks.size()), options.jobs, LargestOf(tasks),
                               backend.limits, progress);
  Executor(folder, backend, stop, progress, std::move(tasks)).Run(jobs);
  for (const auto& [file, why] : RunIndex(folder).Refresh()) progress.Say(why);
  return progress.Status();
}

}  // namespace grouser::campaign
