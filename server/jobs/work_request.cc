#include "server/jobs/work_request.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include "server/core/model_reference.h"
#include "server/core/status.h"
#include "server/jobs/request_checks.h"

namespace grouser::server {
namespace {

using v1alpha1::CalibrationWork;
using v1alpha1::CampaignWork;

[[noreturn]] void RefuseWork(const std::string& message) {
  throw StatusError(StatusCode::kInvalidArgument, message);
}

std::string Shown(const std::string& name) { return Quote(name); }

/// A path that stays below its folder, shows in a log as it is, and names no hidden file.
bool IsFileName(const std::string& name) {
  if (name.empty() || name.size() > kMostFileName) return false;
  if (std::count(name.begin(), name.end(), '/') > kMostFolders) return false;  // each is synced
  bool begins = true;                                                          // a part of the path
  for (const unsigned char c : name) {
    if (begins && (c == '.' || c == '/' || c == '-')) return false;
    if (std::isalnum(c) == 0 && c != '.' && c != '_' && c != '-' && c != '/') return false;
    begins = c == '/';
  }
  return !begins;
}

void CheckFileName(const std::string& field, const std::string& name) {
  if (IsFileName(name)) return;
  RefuseWork(
      fmt::format("{}: {}, expected at most {} letters, digits, '.', '_', '-' and '/' between "
                  "folders, at most {} of them, no part of which begins with '.' or '-'",
                  field, Shown(name), kMostFileName, kMostFolders));
}

std::set<std::string> CheckFiles(const WorkRequest& request) {
  if (request.files.size() > kMostFiles) {
    RefuseWork(fmt::format("files: {}, expected at most {}", request.files.size(), kMostFiles));
  }
  std::set<std::string> names;
  std::size_t bytes = 0;
  for (const auto& file : request.files) {
    CheckFileName("files.name", file.name());
    bytes += file.content().size();
    if (!names.insert(file.name()).second)
      RefuseWork("files.name: " + Shown(file.name()) + " twice");
  }
  for (const std::string& name : names) {
    const auto below = names.upper_bound(name + "/");
    if (below != names.end() && below->starts_with(name + "/")) {
      RefuseWork("files.name: " + Shown(name) + " is a file and the folder of " + Shown(*below));
    }
  }
  if (bytes > kMostFileBytes) {
    RefuseWork(fmt::format("files: {} bytes, expected at most {}", bytes, kMostFileBytes));
  }
  return names;
}

void CheckNamed(const char* field, const std::string& name, const std::set<std::string>& files) {
  if (files.contains(name)) return;
  RefuseWork(
      fmt::format("{}: {}, expected the name of one of the request's files", field, Shown(name)));
}

void CheckCampaignWork(const CampaignWork& campaign, const std::set<std::string>& files) {
  CheckFileName("campaign.file", campaign.file());
  if (campaign.runs() != 0) RefuseWork("campaign.runs: set, expected the server to count them");
  if (campaign.server_files_size() > kMostFiles) {
    RefuseWork(fmt::format("campaign.server_files: {}, expected at most {}",
                           campaign.server_files_size(), kMostFiles));
  }
  for (const std::string& name : campaign.server_files()) {
    CheckFileName("campaign.server_files", name);
    if (name.find('/') != name.npos) {
      RefuseWork("campaign.server_files: " + Shown(name) + ", expected a name without a folder");
    }
    if (files.contains(name))
      RefuseWork("campaign.server_files: " + Shown(name) + " comes along, too");
  }
  if (!campaign.from_server()) {
    CheckNamed("campaign.file", campaign.file(), files);
  } else if (!files.empty() || campaign.server_files_size() > 0) {
    RefuseWork("campaign.from_server: with files, expected none: its own lie beside it");
  }
}

void CheckCalibrationWork(const CalibrationWork& work, const std::set<std::string>& files) {
  const bool grains = work.kind() == v1alpha1::CALIBRATION_KIND_GRAINS;
  if (!grains && work.kind() != v1alpha1::CALIBRATION_KIND_SOIL) {
    RefuseWork(fmt::format("calibration.kind: {}, expected SOIL or GRAINS",
                           static_cast<int>(work.kind())));
  }
  CheckNamed("calibration.data", work.data(), files);
  if (!grains) {
    const bool more = !work.soil().empty() || !work.scene().empty() || !work.vary().empty() ||
                      work.budget_hours() != 0 || work.points() != 0;
    if (more) {
      RefuseWork(
          "calibration: soil, scene, vary, budget_hours or points, expected none for kind SOIL");
    }
    return;
  }
  CheckNamed("calibration.soil", work.soil(), files);
  CheckNamed("calibration.scene", work.scene(), files);
  if (!work.vary().empty()) CheckNamed("calibration.vary", work.vary(), files);
  const double hours = work.budget_hours();
  if (!(hours > 0 && hours <= kMostBudgetHours)) {
    RefuseWork(fmt::format("calibration.budget_hours: {}, expected a number above 0, at most {}",
                           hours, kMostBudgetHours));
  }
  if (work.points() == 1 || work.points() > kMostPoints) {
    RefuseWork(
        fmt::format("calibration.points: {}, expected 0 or 2 to {}", work.points(), kMostPoints));
  }
}

template <class Request>
WorkRequest Envelope(const Request& request, const char* kind) {
  WorkRequest out;
  out.request_id = request.request_id();
  out.content = kind + ContentOf(request);
  out.job.set_priority(request.priority());
  if (request.has_time_limit()) *out.job.mutable_time_limit() = request.time_limit();
  out.files = request.files();
  return out;
}

}  // namespace

WorkRequest WorkOf(const v1alpha1::SubmitCampaignRequest& request) {
  WorkRequest out = Envelope(request, "campaign/");
  *out.job.mutable_campaign() = request.campaign();
  out.job.DiscardUnknownFields();  // they would be stored, and sent with every job
  return out;
}

WorkRequest WorkOf(const v1alpha1::SubmitCalibrationRequest& request) {
  WorkRequest out = Envelope(request, "calibration/");
  *out.job.mutable_calibration() = request.calibration();
  out.job.DiscardUnknownFields();
  return out;
}

bool HasWork(const v1alpha1::Job& job) { return job.work_case() != v1alpha1::Job::WORK_NOT_SET; }

void CheckWork(const WorkRequest& request) {
  const v1alpha1::Job& job = request.job;
  CheckEnvelope(request.request_id, job.priority(),
                job.has_time_limit() ? &job.time_limit() : nullptr);
  const std::set<std::string> names = CheckFiles(request);
  if (job.has_campaign()) CheckCampaignWork(job.campaign(), names);
  if (job.has_calibration()) CheckCalibrationWork(job.calibration(), names);
}

std::string JoinKeyOf(const WorkRequest& request) {
  // The request without what does not change the work.
  v1alpha1::SubmitCampaignRequest files;
  *files.mutable_files() = request.files;
  v1alpha1::Job work = request.job;
  work.clear_priority();
  return "work/" + HashOf(work) + "/" + HashOf(files);
}

}  // namespace grouser::server
