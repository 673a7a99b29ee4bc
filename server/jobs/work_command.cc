#include "server/jobs/work_command.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "proto/records/os/regular_file.h"
#include "proto/records/sha256.h"
#include "server/core/model_reference.h"

namespace grouser::server {
namespace {

using v1alpha1::CalibrationWork;
using v1alpha1::Job;

constexpr char kPython[] = "/usr/bin/python3";
constexpr char kGrains[] = "/dem_offline/calibrate_grains/calibrate_grains.py";
constexpr char kSoils[] = "/surrogate/soils/bekker_soils.csv";
constexpr char kSoilPage[] = "/surrogate/calibrate/calibrate.py";
/// Looked for, not loaded: that takes seconds.
constexpr char kModules[] =
    "import importlib.util, sys\n"
    "missing = [m for m in sys.argv[1:] if importlib.util.find_spec(m) is None]\n"
    "sys.exit('expected Python modules: ' + ', '.join(missing) if missing else 0)\n";
constexpr std::size_t kMostPart = 512 * 1024;
/// Runs of a start before, which was killed, end late at idle priority.
constexpr char kWaitS[] = "600";

bool IsGrains(const CalibrationWork& work) {
  return work.kind() == v1alpha1::CALIBRATION_KIND_GRAINS;
}
bool NeedsPython(const Job& job) {
  return job.has_calibration() && (IsGrains(job.calibration()) || job.calibration().report());
}

std::string Input(const std::string& name) { return std::string(kInputFolder) + "/" + name; }

void RequireProgram(const std::string& path, const std::string& what) {
  if (::access(path.c_str(), X_OK) == 0) return;
  throw StatusError(
      StatusCode::kFailedPrecondition,
      what + ": this server lacks " + std::filesystem::path(path).filename().string());
}

/// Its table of soils, and what writes a page or calibrates grains.
void RequireCheckout(const CalibrationWork& work, const WorkPrograms& programs) {
  const char* what = "calibration";
  std::string file = kSoils;
  if (work.report()) what = "calibration.report", file = kSoilPage;
  if (IsGrains(work)) what = "calibration.kind: GRAINS", file = kGrains;
  if (file != kSoils) RequireProgram(kPython, what);
  const std::string& checkout = programs.options.scripts_dir;
  if (!checkout.empty() && std::filesystem::exists(checkout + file)) return;
  throw StatusError(StatusCode::kFailedPrecondition,
                    fmt::format("{}: this server lacks {}, expected a checkout of Grouser "
                                "(grouser-jobs --scripts)",
                                what, file.substr(1)));
}

/// From the request's files, or the operator's.
std::string CampaignFile(const Job& job, const WorkPrograms& programs) {
  const auto& campaign = job.campaign();
  return campaign.from_server() ? programs.options.campaigns_dir + "/" + campaign.file()
                                : Input(campaign.file());
}

std::vector<std::string> GrainsCommand(const CalibrationWork& work, const WorkPrograms& programs) {
  std::vector<std::string> argv = {kPython,
                                   programs.options.scripts_dir + kGrains,
                                   Input(work.data()),
                                   "--soil",
                                   Input(work.soil()),
                                   "--scene",
                                   Input(work.scene()),
                                   "--budget",
                                   fmt::format("{:.6g}", work.budget_hours()),
                                   "--jobs",
                                   std::to_string(programs.options.parallel),
                                   "--bin",
                                   programs.bin_dir,
                                   "--out",
                                   kOutFolder};
  if (!work.vary().empty()) argv.insert(argv.end(), {"--vary", Input(work.vary())});
  if (work.points() > 0) argv.insert(argv.end(), {"--points", std::to_string(work.points())});
  return argv;
}

}  // namespace

void CheckMeans(const Job& job, const WorkPrograms& programs) {
  if (job.has_campaign()) {
    RequireProgram(programs.bin_dir + "/grouser-dem", "campaign");
    const auto& campaign = job.campaign();
    if (!campaign.from_server() && campaign.server_files().empty()) return;
    const std::string& folder = programs.options.campaigns_dir;
    if (folder.empty()) {
      throw StatusError(StatusCode::kFailedPrecondition,
                        "campaign: names a file of the server, which has no folder for them "
                        "(grouser-jobs --campaigns); expected the file itself");
    }
    std::vector<std::string> names(campaign.server_files().begin(), campaign.server_files().end());
    if (campaign.from_server()) names.push_back(campaign.file());
    for (const std::string& name : names) {
      std::error_code ignored;
      if (std::filesystem::is_regular_file(folder + "/" + name, ignored)) continue;
      throw StatusError(StatusCode::kNotFound,
                        "campaign: the server's folder has no file " + Quote(name));
    }
    return;
  }
  const CalibrationWork& work = job.calibration();
  RequireProgram(programs.bin_dir + "/grouser-calibrate", "calibration");
  if (IsGrains(work)) RequireProgram(programs.bin_dir + "/grouser-dem", "calibration.kind: GRAINS");
  RequireCheckout(work, programs);
  const double most_h = programs.options.timeout_s / 3600;
  if (programs.options.timeout_s > 0 && work.budget_hours() > most_h) {
    throw StatusError(StatusCode::kInvalidArgument,
                      fmt::format("calibration.budget_hours: {:.6g}, expected at most {:.6g}, this "
                                  "server's limit",
                                  work.budget_hours(), most_h));
  }
}

std::vector<CheckStep> ChecksOf(const Job& job, const WorkPrograms& programs) {
  std::vector<CheckStep> steps;
  if (NeedsPython(job)) {
    steps.push_back(
        {{kPython, "-c", kModules, "matplotlib", "numpy"}, StatusCode::kFailedPrecondition});
    if (IsGrains(job.calibration())) {
      steps[0].argv.insert(steps[0].argv.end(), {"openturns", "yaml"});
    }
  }
  if (job.has_campaign()) {
    const std::string within =
        job.campaign().from_server() ? programs.options.campaigns_dir : std::string(kInputFolder);
    steps.push_back({{programs.bin_dir + "/grouser-dem", "campaign", "check",
                      CampaignFile(job, programs), "--within", within},
                     StatusCode::kInvalidArgument});
    return steps;
  }
  const CalibrationWork& work = job.calibration();
  steps.push_back({{programs.bin_dir + "/grouser-calibrate", "rows", Input(work.data()), "--within",
                    kInputFolder},
                   StatusCode::kInvalidArgument});
  if (IsGrains(work)) {
    steps.push_back({GrainsCommand(work, programs), StatusCode::kFailedPrecondition});
    steps.back().argv.push_back("--dry-run");
  }
  return steps;
}

std::vector<std::string> CommandOf(const Job& job, const WorkPrograms& programs) {
  const std::string parallel = std::to_string(programs.options.parallel);
  if (job.has_campaign()) {
    return {programs.bin_dir + "/grouser-dem",
            "campaign",
            "run",
            CampaignFile(job, programs),
            "--out",
            kOutFolder,
            "--jobs",
            parallel,
            "--device",
            programs.device,
            "--json",
            "--progress-lines",
            "--runs-json",
            std::string(kOutFolder) + "/runs.json"};
  }
  const CalibrationWork& work = job.calibration();
  if (IsGrains(work)) {
    auto argv = GrainsCommand(work, programs);
    argv.insert(argv.end(), {"--progress-lines", "--wait", kWaitS});
    return argv;
  }
  std::vector<std::string> argv = {programs.bin_dir + "/grouser-calibrate"};
  if (work.report()) {
    argv = {kPython, programs.options.scripts_dir + kSoilPage, "--bin", programs.bin_dir};
  }
  argv.insert(argv.end(), {"soil", Input(work.data()), "--out", kOutFolder});
  return argv;
}

std::string ProgramOf(const Job& job) {
  if (job.has_campaign()) return "grouser-dem campaign run";
  return IsGrains(job.calibration()) ? "calibrate grains" : "calibrate soil";
}

std::vector<v1alpha1::JobResult> ResultsOf(const Job& job, const JobFiles& files) {
  std::vector<std::string> names = {"campaign.json", "runs.json"};
  if (job.has_calibration()) {
    names = {"soil.csv",    "calibration.json",     "report.html",
             "design.json", "calibrated.soil.yaml", "calibrated.scene.yaml"};
  }
  std::vector<v1alpha1::JobResult> found;
  for (const std::string& name : names) {
    const std::string path = files.Result(job.job_id(), name);
    std::error_code error;
    const auto bytes = std::filesystem::file_size(path, error);
    if (error) continue;
    v1alpha1::JobResult result;
    result.set_name(name);
    result.set_bytes(bytes);
    try {
      result.set_sha256(records::Sha256OfFile(path));
    } catch (const std::exception& e) {  // the job ends all the same
      spdlog::error("{}: {}; not handed out", job.job_id(), e.what());
      continue;
    }
    found.push_back(std::move(result));
  }
  return found;
}

v1alpha1::ReadJobFileResponse ReadResult(const Job& job, const JobFiles& files,
                                         const v1alpha1::ReadJobFileRequest& request) {
  const auto known = std::ranges::find(job.results(), request.name(), &v1alpha1::JobResult::name);
  const auto refuse = [&](const std::string& what) {
    throw StatusError(StatusCode::kNotFound, "name: " + Quote(request.name()) + ": " + what);
  };
  if (known == job.results().end()) {
    std::string names;
    for (const auto& result : job.results()) names += (names.empty() ? "" : ", ") + result.name();
    refuse("no result of job '" + job.job_id() + "', which has " +
           (names.empty() ? "none" : names));
  }
  v1alpha1::ReadJobFileResponse response;
  try {
    const os::UniqueFd fd = os::OpenRegular(files.Result(job.job_id(), known->name()), O_RDONLY);
    response.set_bytes(known->bytes());
    if (request.offset() >= known->bytes()) return response;
    std::string& data = *response.mutable_data();
    data.resize(std::min<std::uint64_t>(kMostPart, known->bytes() - request.offset()));
    const ssize_t n =
        ::pread(fd.get(), data.data(), data.size(), static_cast<off_t>(request.offset()));
    if (n != static_cast<ssize_t>(data.size())) refuse("it is shorter than it was");
  } catch (const StatusError&) {
    throw;
  } catch (const std::exception& e) {
    refuse(e.what());
  }
  return response;
}

}  // namespace grouser::server
