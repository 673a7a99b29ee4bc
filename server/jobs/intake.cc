#include "server/jobs/intake.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "grouser/v1alpha1/campaign.pb.h"
#include "proto/records/durable_file.h"
#include "proto/records/message_json.h"
#include "proto/records/model_file.h"
#include "server/core/status.h"
#include "server/jobs/worker_log.h"

namespace grouser::server {
namespace {

namespace fs = std::filesystem;

constexpr char kPrefix[] = "check-";
constexpr std::uint64_t kCheckBytes = std::uint64_t{4} << 30;  ///< address space
constexpr std::uint64_t kMostServerFile = 1 << 20;

void RemoveFolder(const std::string& folder) {
  std::error_code error;
  fs::remove_all(folder, error);
  if (error) spdlog::error("{}: cannot be removed: {}", folder, error.message());
}

/// Why a request is refused, by how its check has ended.
StatusError RefusalOf(const CheckStep& step, const WorkerEnd& end, const std::string& words) {
  const std::string program = fs::path(step.argv[0]).filename().string();
  if (end.Exited(2)) return {StatusCode::kInvalidArgument, words.empty() ? program : words};
  if (end.timed_out) {
    return {StatusCode::kResourceExhausted,
            fmt::format("the request takes more than {} s to check", Intake::kCheckS)};
  }
  if (!end.spawn_error.empty()) return {StatusCode::kFailedPrecondition, end.Text()};
  return {step.otherwise, fmt::format("the check of the request by {} {}{}{}", program, end.Text(),
                                      words.empty() ? "" : ": ", words)};
}

}  // namespace

Intake::Intake(WorkPrograms programs, WorkerLimits limits, const JobFiles& files, JobBook& book,
               WorkerPool& pool, SerialThread& thread)
    : programs_(std::move(programs)),
      limits_(limits),
      files_(files),
      book_(book),
      pool_(pool),
      thread_(thread) {
  limits_.idle = false;  // a client waits
  limits_.memory_bytes =
      limits.memory_bytes == 0 ? kCheckBytes : std::min(limits.memory_bytes, kCheckBytes);
  for (const auto& entry : fs::directory_iterator(files_.Below("jobs"))) {
    if (entry.path().filename().string().starts_with(kPrefix)) RemoveFolder(entry.path().string());
  }
}

void Intake::Submit(WorkRequest request, const std::string& who, Done done) {
  CheckWork(request);
  if (const auto known = book_.Replay(request.request_id, request.content)) {
    done(nullptr, *known);
    return;
  }
  CheckMeans(request.job, programs_);
  const auto own = static_cast<std::size_t>(
      std::ranges::count_if(checks_, [&](const auto& one) { return one.second.who == who; }));
  if (own >= kMostAsked) {
    throw StatusError(StatusCode::kResourceExhausted,
                      fmt::format("requests: {} of this client are being checked, expected fewer "
                                  "than {}; try again later",
                                  own, kMostAsked));
  }
  const std::string id = NewJobId();
  Check check;
  check.steps = ChecksOf(request.job, programs_);
  check.request = std::move(request);
  check.who = who;
  check.folder = files_.Below("jobs") + "/" + kPrefix + id;
  check.done = std::move(done);
  try {
    WriteFiles(check.request, check.folder);
  } catch (...) {
    RemoveFolder(check.folder);
    throw;
  }
  check.order = ++asked_;
  checks_.emplace(id, std::move(check));
  StartChecks();
}

void Intake::StartChecks() {
  for (;;) {
    std::map<std::string, int> of;
    int all = 0;
    for (const auto& [id, check] : checks_) {
      of[check.who] += check.runs;
      all += check.runs;
    }
    if (all >= kMostChecks) return;
    auto next = checks_.end();
    const auto place = [&](auto it) { return std::pair(of[it->second.who], it->second.order); };
    for (auto it = checks_.begin(); it != checks_.end(); ++it) {
      if (it->second.runs || of[it->second.who] >= kMostOfOne) continue;
      if (next == checks_.end() || place(it) < place(next)) next = it;
    }
    if (next == checks_.end()) return;
    next->second.runs = true;
    StartStep(next->first);
  }
}

void Intake::WriteFiles(const WorkRequest& request, const std::string& folder) const {
  const fs::path input = fs::path(folder) / kInputFolder;
  const auto write = [&](const std::string& name, const std::string& content) {
    records::MakeFolderDurably((input / name).parent_path().string());
    records::WriteFileDurably((input / name).string(), content);
  };
  records::MakeFolderDurably(input.string());
  for (const auto& file : request.files) write(file.name(), file.content());
  for (const std::string& name : request.job.campaign().server_files()) {
    write(name,
          records::ReadFileBytes(programs_.options.campaigns_dir + "/" + name, kMostServerFile));
  }
}

std::string Intake::Output(const Check& check, const char* ending) const {
  return fmt::format("{}/check.{}.{}", check.folder, check.step, ending);
}

void Intake::StartStep(const std::string& id) {
  const Check& check = checks_.at(id);
  WorkerCommand command;
  command.argv = check.steps[check.step].argv;
  command.folder = check.folder;
  command.stdout_path = Output(check, "stdout");
  command.log_path = Output(check, "log");
  command.limits = limits_;
  command.timeout_s = kCheckS;
  pool_.Start(
      kPrefix + id, std::move(command),
      {[](const ProgressLine&) {},
       [this, id](const WorkerEnd& end) { thread_.Post([this, id, end] { OnEnd(id, end); }); }});
}

void Intake::OnEnd(const std::string& id, const WorkerEnd& end) {
  const auto found = checks_.find(id);
  if (found == checks_.end()) return;  // stopped, and answered
  Check& check = found->second;
  if (end.Exited(0) && check.step + 1 < check.steps.size()) {
    ++check.step;
    StartStep(id);
    return;
  }
  const Check ended = std::move(check);
  checks_.erase(found);
  StartChecks();
  std::exception_ptr problem;
  bool in_doubt = false;  // the store refused, and may hold the job all the same
  v1alpha1::SubmitJobResponse response;
  try {
    if (!end.Exited(0)) {
      throw RefusalOf(ended.steps[ended.step], end, LastWords(Output(ended, "log")));
    }
    response = Accept(id, ended);
  } catch (const SqliteError&) {
    in_doubt = true;
    problem = std::current_exception();
  } catch (...) {
    problem = std::current_exception();
  }
  if (response.job().job_id() != id) {  // refused, joined or known
    RemoveFolder(ended.folder);
    if (!in_doubt) RemoveFolder(files_.Folder(id));
  }
  ended.done(problem, response);
}

v1alpha1::SubmitJobResponse Intake::Accept(const std::string& id, const Check& check) {
  JobRow row;
  row.job = check.request.job;
  row.job.set_job_id(id);
  row.join_key = JoinKeyOf(check.request);
  if (row.job.has_campaign()) {
    v1alpha1::CampaignStatus planned;
    records::FromJson(records::ReadFileBytes(Output(check, "stdout")), "grouser-dem campaign check",
                      &planned, /*earlier=*/true);
    const std::uint32_t most = programs_.options.max_runs;
    if (planned.total() > most) {
      throw StatusError(StatusCode::kInvalidArgument,
                        fmt::format("campaign: {} runs, expected at most {}, this server's limit",
                                    planned.total(), most));
    }
    row.job.mutable_campaign()->set_runs(planned.total());
  }
  for (const auto& entry : fs::directory_iterator(check.folder)) {
    if (entry.path().filename() != kInputFolder) RemoveFolder(entry.path().string());
  }
  records::RenameFolderDurably(check.folder, files_.Folder(id));
  return book_.Submit(check.request.request_id, check.request.content, std::move(row), check.who);
}

void Intake::Stop() {
  for (const auto& [id, check] : std::exchange(checks_, {})) {
    pool_.Terminate(kPrefix + id);
    check.done(std::make_exception_ptr(
                   StatusError(StatusCode::kUnavailable, "the jobs program is stopping")),
               {});
  }
}

}  // namespace grouser::server
