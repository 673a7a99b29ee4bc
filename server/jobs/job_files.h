#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "server/jobs/job_store.h"

namespace grouser::server {

/// Where things lie below the state folder.
class JobFiles {
 public:
  /// Makes the folders. Throws std::runtime_error naming the one that failed.
  explicit JobFiles(std::string state_dir);

  std::string Database() const { return state_ + "/jobs/jobs.sqlite"; }
  std::string InstanceLock() const { return state_ + "/jobs/lock"; }
  /// A folder of the state folder.
  std::string Below(const std::string& folder) const { return state_ + "/" + folder; }
  std::string Tiles() const { return state_ + "/tiles"; }
  std::string Run(const std::string& file) const { return state_ + "/runs/" + file; }

  std::string Folder(const std::string& job_id) const { return state_ + "/jobs/" + job_id; }
  std::string Lock(const std::string& job_id) const { return Folder(job_id) + "/lock"; }
  std::string Spec(const std::string& job_id) const { return Folder(job_id) + "/spec.json"; }
  /// Where the DEM worker writes; PublishRun gives the file its lasting name.
  std::string WorkerRun(const std::string& job_id) const { return Folder(job_id) + "/run.h5"; }
  std::string Candidate(const std::string& job_id) const {
    return Folder(job_id) + "/candidate.model";
  }
  /// There where a candidate with the runs of others did no good: this one is fitted without them.
  std::string Alone(const std::string& job_id) const { return Folder(job_id) + "/alone"; }
  /// What a campaign or calibration was given and has left.
  std::string Input(const std::string& job_id, const std::string& name) const {
    return Folder(job_id) + "/input/" + name;
  }
  std::string Result(const std::string& job_id, const std::string& name) const {
    return Folder(job_id) + "/out/" + name;
  }
  /// Output of a stage; named by the lease epoch, so that a stale worker
  /// writes into nobody's file.
  std::string Output(const v1alpha1::Job& job, const std::string& stage, const char* ending) const;

 private:
  std::string state_;
};

/// Bytes of a file, or of all regular files below a folder; links are not followed.
std::uint64_t BytesBelow(const std::filesystem::path& path);

/// A finished run: what it says, the hash of its file, and that file's base
/// name in runs/.
struct FinishedRun {
  v1alpha1::RunRecord record;
  std::string sha256, file;
};

/// Throws std::runtime_error where the file cannot be read or answers another
/// spec.
FinishedRun ReadFinishedRun(const std::string& path, const v1alpha1::WheelTestSpec& spec);

/// Gives a worker's run file its lasting name, runs/RUNID.run.h5. Run files
/// are immutable, for models name them by hash: where a whole one of this id
/// (same spec, same engine) is there already, that one is the answer. A FAILED
/// one is none, and no model names it: the latest is kept as RUNID.run.h5.failed.
/// Throws std::runtime_error.
FinishedRun PublishRun(const JobFiles& files, const JobRow& row);

/// Throws std::runtime_error where the file is no model of that name, refitted
/// from that base with that run (all by hash). Returns its digest.
std::string CheckCandidate(const std::string& path, const v1alpha1::Job& job);

/// "name@sha256:HEX", and its parts.
std::string ReferenceOf(const std::string& name, const std::string& digest);
std::string ModelName(const v1alpha1::Job& job);
std::string ModelDigest(const v1alpha1::Job& job);

/// `[{"name", "passed", "detail"}, ...]` as grouser-fit gate prints it. Throws
/// std::runtime_error for other text or an empty list.
void ParseGate(const std::string& json, v1alpha1::Job* job);

}  // namespace grouser::server
