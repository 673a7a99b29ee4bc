#include "server/jobs/job_files.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>
#include <stdexcept>

#include "proto/records/durable_file.h"
#include "proto/records/message_json.h"
#include "proto/records/model_file.h"
#include "proto/records/os/regular_file.h"
#include "proto/records/run_file.h"
#include "server/jobs/refinement_spec.h"

namespace grouser::server {
namespace {

constexpr char kDigestMark[] = "@sha256:";

constexpr char kFailedSuffix[] = ".failed";

/// Keeps the FAILED run of a state that is run again, over the one before it: one a state. Whether
/// or not that can be, the new one is written in its place.
void KeepFailed(const std::string& target, const std::string& reason) {
  std::error_code error;
  std::filesystem::rename(target, target + kFailedSuffix, error);
  spdlog::warn("{}: FAILED ({}), and was run again; it is {}", target, reason,
               error ? "replaced: no " + target + kFailedSuffix + ": " + error.message()
                     : "kept as " + target + kFailedSuffix);
}

/// The run of that name that answers in place of the one that a worker has made; what stands there
/// and does not is kept by another name.
std::optional<FinishedRun> RunThere(const std::string& target, const v1alpha1::WheelTestSpec& spec,
                                    const std::string& made) {
  if (!std::filesystem::exists(target)) return std::nullopt;
  FinishedRun there;
  try {
    there = ReadFinishedRun(target, spec);
  } catch (const std::exception& e) {
    spdlog::warn("{}; it is set aside as {}", e.what(), os::SetAside(target));
    return std::nullopt;
  }
  if (there.record.status() == v1alpha1::RUN_STATUS_FAILED &&
      there.sha256 != records::Sha256OfFile(made)) {
    KeepFailed(target, there.record.reason());
    return std::nullopt;
  }
  records::SyncName(target);  // who wrote it may have been killed before this
  return there;
}

}  // namespace

JobFiles::JobFiles(std::string state_dir)
    : state_(std::filesystem::absolute(state_dir).lexically_normal().string()) {
  if (state_.ends_with('/') && state_.size() > 1) state_.pop_back();
  for (const char* folder : {"/jobs", "/runs", "/tiles", "/models"}) {
    records::MakeFolderDurably(state_ + folder);
  }
}

std::string JobFiles::Output(const v1alpha1::Job& job, const std::string& stage,
                             const char* ending) const {
  return fmt::format("{}/{}.{}.{}", Folder(job.job_id()), stage, job.lease_epoch(), ending);
}

std::uint64_t BytesBelow(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::is_symlink(path, error)) return 0;
  if (!fs::is_directory(path, error)) {
    const auto size = fs::file_size(path, error);
    return error ? 0 : size;
  }
  std::uint64_t sum = 0;
  for (fs::recursive_directory_iterator it(path, error), end; !error && it != end;
       it.increment(error)) {
    std::error_code ignored;
    if (it->is_regular_file(ignored)) sum += it->file_size(ignored);
  }
  return sum;
}

FinishedRun ReadFinishedRun(const std::string& path, const v1alpha1::WheelTestSpec& spec) {
  FinishedRun run;
  run.record = records::ReadRunFile(path).record;
  if (!Answers(run.record, spec)) {
    throw std::runtime_error(path + ": its record answers another spec than the job asks");
  }
  run.sha256 = records::Sha256OfFile(path);
  run.file = std::filesystem::path(path).filename().string();
  return run;
}

FinishedRun PublishRun(const JobFiles& files, const JobRow& row) {
  const std::string made = files.WorkerRun(row.job.job_id());
  const std::string run_id = ReadFinishedRun(made, row.spec).record.run_id();
  // It becomes a file name.
  const bool plain = !run_id.empty() && run_id.size() <= 64 &&
                     std::all_of(run_id.begin(), run_id.end(),
                                 [](unsigned char c) { return std::isalnum(c) != 0; });
  if (!plain) throw std::runtime_error(made + ": run_id '" + run_id + "', expected hex digits");
  const std::string target = files.Run(run_id + ".run.h5");
  if (auto there = RunThere(target, row.spec, made)) return *there;
  records::WriteFileDurably(target, records::ReadFileBytes(made));
  return ReadFinishedRun(target, row.spec);
}

std::string CheckCandidate(const std::string& path, const v1alpha1::Job& job) {
  const auto loaded = records::ReadModelFile(path);
  if (loaded.model.name() != ModelName(job)) {
    throw std::runtime_error(path + ": is a model '" + loaded.model.name() + "', expected '" +
                             ModelName(job) + "'");
  }
  const auto& provenance = loaded.model.provenance();
  if (provenance.base_digest() != ModelDigest(job)) {
    throw std::runtime_error(path + ": was refitted from '" + provenance.base_digest() +
                             "', expected '" + ModelDigest(job) + "'");
  }
  const bool named = std::any_of(
      provenance.runs().begin(), provenance.runs().end(),
      [&](const v1alpha1::RunSummary& run) { return run.sha256() == job.run_sha256(); });
  if (!named) {
    throw std::runtime_error(path + ": its provenance does not name the run " + job.run_file() +
                             " (sha256 " + job.run_sha256() + ")");
  }
  return loaded.digest;
}

std::string ReferenceOf(const std::string& name, const std::string& digest) {
  return name + kDigestMark + digest;
}

std::string ModelName(const v1alpha1::Job& job) {
  return job.model().substr(0, job.model().find(kDigestMark));
}

std::string ModelDigest(const v1alpha1::Job& job) {
  const auto at = job.model().find(kDigestMark);
  return at == std::string::npos ? "" : job.model().substr(at + sizeof(kDigestMark) - 1);
}

void ParseGate(const std::string& json, v1alpha1::Job* job) {
  const std::string where = "gate: the output of grouser-fit gate";
  v1alpha1::Job parsed;
  records::FromJson("{\"gate\":" + json + "}", where, &parsed, /*earlier=*/true);
  // An object is read as a list of one by protobuf: without a name it is none.
  const bool named = std::all_of(parsed.gate().begin(), parsed.gate().end(),
                                 [](const v1alpha1::GateCheck& c) { return !c.name().empty(); });
  if (parsed.gate().empty() || !named) throw std::runtime_error(where + ": no list of checks");
  *job->mutable_gate() = parsed.gate();
}

}  // namespace grouser::server
