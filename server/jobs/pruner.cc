#include "server/jobs/pruner.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "proto/records/model_file.h"
#include "server/core/alias_history.h"
#include "server/core/page.h"
#include "server/jobs/job_state.h"

namespace grouser::server {
namespace {

namespace fs = std::filesystem;

constexpr double kMega = 1e6;
constexpr int kMostFailed = 100;              ///< named in one answer
constexpr std::size_t kMostFailedText = 500;  ///< characters of each

/// What must stay.
struct Kept {
  std::set<std::string> digests, run_files;
  bool tiles = false;
};

/// What may go.
struct Item {
  double unix_s = 0;  ///< of its last change
  int order = 0;      ///< among equally old ones: rows before what they name
  std::string name;   ///< below the state folder; a job's id
  std::string path;
  std::uint64_t bytes = 0;
  bool is_job = false;
};

/// When a file was last written; of a tile, or read.
double TimeOf(const std::string& path, bool read) {
  struct stat info {};
  if (::lstat(path.c_str(), &info) != 0) return 0;
  const time_t seconds =
      read ? std::max(info.st_mtim.tv_sec, info.st_atim.tv_sec) : info.st_mtim.tv_sec;
  return static_cast<double>(seconds);
}

bool IsFile(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(fs::symlink_status(path, ignored));
}

double SecondsOf(const google::protobuf::Timestamp& time) {
  return static_cast<double>(time.seconds()) + 1e-9 * time.nanos();
}

std::vector<fs::path> EntriesOf(const std::string& folder) {
  std::vector<fs::path> paths;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    paths.push_back(it->path());
  }
  if (error && error != std::errc::no_such_file_or_directory) {
    throw std::runtime_error(folder + ": " + error.message());
  }
  return paths;
}

/// What the models of `digests` name goes to `kept`.
void KeepWhatModelsName(const Repository& repository, const std::set<std::string>& digests,
                        Kept* kept) {
  kept->digests.insert(digests.begin(), digests.end());
  for (const Repository::File& file : repository.Files()) {
    // Shipped ones bear other names, and are few.
    if (!file.shipped && !digests.contains(fs::path(file.path).stem().string())) continue;
    records::LoadedModel loaded;
    try {
      loaded = Repository::Read(file);
    } catch (const std::exception&) {
      if (!file.shipped) throw;
      continue;  // nothing here was made of it
    }
    const auto& provenance = loaded.model.provenance();
    if (!provenance.base_digest().empty()) kept->digests.insert(provenance.base_digest());
    for (const auto& run : provenance.runs()) {
      kept->run_files.insert(run.file());
      kept->run_files.insert(run.run_id() + ".run.h5");
    }
  }
}

Kept FindKept(const Repository& repository, const Repository::Aliases& aliases,
              const std::vector<JobRow>& open) {
  Kept kept;
  std::set<std::string> digests;
  for (const auto& [name, of_model] : aliases.by_model) {
    for (const auto& [alias, digest] : of_model) digests.insert(digest);
  }
  for (const auto& digest : NamedLately(aliases, kRollbacksKept)) digests.insert(digest);
  for (const JobRow& row : open) {
    if (!row.job.model().empty()) digests.insert(ModelDigest(row.job));
    if (!row.job.candidate_digest().empty()) digests.insert(row.job.candidate_digest());
    if (!row.job.run_file().empty()) kept.run_files.insert(row.job.run_file());
    kept.tiles |= IsWorking(row.job.job_state());
  }
  KeepWhatModelsName(repository, digests, &kept);
  return kept;
}

/// Finds what may go: `last_use` holds, of what ended jobs name, when the last of them ended.
class Finder {
 public:
  Finder(const JobFiles& files, JobStore& store, const Kept& kept) : files_(files), kept_(kept) {
    std::set<std::string> known;
    store.ForEach([&](const v1alpha1::Job& job, std::uint64_t bytes) {
      known.insert(job.job_id());
      if (!HasEnded(job.job_state())) return;
      const double ended = SecondsOf(job.update_time());
      const std::string folder = files_.Folder(job.job_id());
      items_.push_back({ended, 0, job.job_id(), folder, bytes + BytesBelow(folder), true});
      for (const std::string& name : {job.candidate_digest() + ".model", job.run_file()}) {
        last_use_[name] = std::max(last_use_[name], ended);
      }
    });
    AddFolders(known);
    AddFiles("models", [&](const fs::path& path) {
      return path.extension() == ".model" && IsFile(path) &&
             !kept_.digests.contains(path.stem().string());
    });
    // Those that were set aside too; nothing else there is this program's.
    AddFiles("runs", [&](const fs::path& path) {
      const std::string name = path.filename().string();
      return name.find(".run.h5") != name.npos && IsFile(path) && !kept_.run_files.contains(name);
    });
    if (!kept_.tiles) AddFiles("tiles", [](const fs::path&) { return true; });
    std::ranges::sort(
        items_, {}, [](const Item& item) { return std::tie(item.unix_s, item.order, item.name); });
  }

  const std::vector<Item>& items() const { return items_; }

 private:
  /// Folders of jobs that have no row.
  void AddFolders(const std::set<std::string>& known) {
    for (const fs::path& path : EntriesOf(files_.Below("jobs"))) {
      const std::string name = path.filename().string();
      std::error_code ignored;
      if (!name.starts_with("job-") || known.contains(name) || !fs::is_directory(path, ignored)) {
        continue;
      }
      Add("jobs", path, 1);
    }
  }
  template <class MayGo>
  void AddFiles(const std::string& folder, MayGo may_go) {
    for (const fs::path& path : EntriesOf(files_.Below(folder))) {
      const bool hidden = path.filename().string().starts_with('.');
      if (!hidden && may_go(path)) Add(folder, path, 2);
    }
  }
  void Add(const std::string& folder, const fs::path& path, int order) {
    const std::string name = path.filename().string();
    const double changed = TimeOf(path.string(), /*read=*/folder == "tiles");
    const auto used = last_use_.find(name);
    const double at = used == last_use_.end() ? changed : std::max(changed, used->second);
    items_.push_back({at, order, folder + "/" + name, path.string(), BytesBelow(path), false});
  }

  const JobFiles& files_;
  const Kept& kept_;
  std::map<std::string, double> last_use_;
  std::vector<Item> items_;
};

/// Why an item goes; empty: it stays.
std::string WhyGone(const PruneLimits& limits, const Item& item, double now, std::uint64_t used) {
  const double age = now - item.unix_s;
  if (age < limits.settle_s) return "";
  if (limits.keep_s > 0 && age > limits.keep_s) {
    return fmt::format("{:.1f} days old, kept are {:.4g}", age / kDayS, limits.keep_s / kDayS);
  }
  if (limits.max_bytes > 0 && used > limits.max_bytes) {
    return fmt::format("{:.1f} MB are used, allowed are {:.1f}", used / kMega,
                       limits.max_bytes / kMega);
  }
  return "";
}

v1alpha1::PrunedItem MessageOf(const Item& item, const std::string& why) {
  v1alpha1::PrunedItem message;
  message.set_name(item.name);
  message.set_bytes(item.bytes);
  *message.mutable_time() = records::TimestampOf(item.unix_s);
  message.set_why(why);
  return message;
}

}  // namespace

Pruner::Pruner(const JobFiles& files, JobStore& store, const JobBook& book,
               const Repository& repository, Remover remove)
    : files_(files),
      store_(store),
      book_(book),
      repository_(repository),
      remove_(std::move(remove)) {}

void Pruner::RemoveAll(const std::string& path) {
  std::error_code error;
  fs::remove_all(path, error);
  if (error) throw std::runtime_error(path + ": cannot be removed: " + error.message());
}

std::string Pruner::Remove(const std::string& path, const std::string& job_id) {
  try {
    if (!job_id.empty()) store_.Remove(job_id);
    remove_(path);
    return "";
  } catch (const std::exception& e) {
    return e.what();
  }
}

v1alpha1::PruneResponse Pruner::Prune(const PruneLimits& limits, bool dry_run, double now_unix_s) {
  v1alpha1::PruneResponse response;
  std::uint64_t used = 0;
  for (const char* folder : {"models", "runs", "tiles", "jobs"}) {
    used += BytesBelow(files_.Below(folder));
  }
  response.set_bytes_before(used);
  response.set_bytes_allowed(limits.max_bytes);
  std::size_t page = 0;
  bool more = true;
  repository_.WithoutMoves([&](const Repository::Aliases& aliases) {
    const Kept kept = FindKept(repository_, aliases, book_.Open());
    const Finder found(files_, store_, kept);
    for (const Item& item : found.items()) {
      const std::string why = WhyGone(limits, item, now_unix_s, used);
      if (why.empty()) continue;
      const std::string problem = dry_run ? "" : Remove(item.path, item.is_job ? item.name : "");
      if (!problem.empty()) {  // the others go all the same
        spdlog::error("not pruned: {}: {}", item.name, problem);
        response.set_failed_count(response.failed_count() + 1);
        if (response.failed_size() < kMostFailed) {
          *response.add_failed() = MessageOf(item, problem.substr(0, kMostFailedText));
        }
        continue;
      }
      if (!dry_run) spdlog::info("pruned {} ({} bytes): {}", item.name, item.bytes, why);
      used -= std::min(used, item.bytes);
      response.set_items_count(response.items_count() + 1);
      response.set_bytes_freed(response.bytes_freed() + item.bytes);
      more = more && AddToPage(MessageOf(item, why), &page, response.mutable_items());
    }
  });
  if (!dry_run && response.items_count() > 0) {
    try {
      store_.Compact();
    } catch (const SqliteError& e) {  // the removals stand; the next pruning tries again
      spdlog::warn("the job store keeps its size: {}", e.what());
    }
  }
  if (limits.max_bytes > 0 && used > limits.max_bytes) {
    spdlog::warn(
        "{:.1f} MB are used, allowed are {:.1f}: what is left is named by an alias, an "
        "open job or a model that is, younger than {:.0f} s, none of this program's, or could not "
        "be removed",
        used / kMega, limits.max_bytes / kMega, limits.settle_s);
  }
  return response;
}

}  // namespace grouser::server
