#include "clients/cli/watch_jobs.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <map>
#include <thread>

#include "clients/cli/job_options.h"
#include "clients/cli/print.h"
#include "proto/records/message_json.h"

namespace grouser::cli {
namespace {

using v1alpha1::Job;
using namespace std::chrono_literals;

constexpr auto kInterval = 1s;
constexpr int kBarCells = 20, kNarrow = 80, kWide = 200;

bool AtWork(const Job& job) {
  switch (job.job_state()) {
    case v1alpha1::JOB_STATE_QUEUED:
    case v1alpha1::JOB_STATE_RUNNING:
    case v1alpha1::JOB_STATE_FITTING:
    case v1alpha1::JOB_STATE_VALIDATING:
      return true;
    default:
      return false;
  }
}

std::string WhatOf(const Job& job) {
  if (job.has_campaign()) return "campaign " + job.campaign().file();
  if (job.has_calibration()) return "calibration from " + job.calibration().data();
  return fmt::format("refines {}", job.model().substr(0, job.model().find('@')));
}

std::string EtaOf(const Job& job) {
  if (!job.has_eta()) return "";
  const auto seconds = job.eta().seconds();
  return seconds < 3600
             ? fmt::format("{}:{:02}", seconds / 60, seconds % 60)
             : fmt::format("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60);
}

/// A server's texts must not move the cursor.
std::string Plain(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < ' ' || c == 0x7f) c = ' ';
  }
  return text;
}

int Columns() {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col < 20) return kNarrow;
  return std::min<int>(size.ws_col, kWide);
}

/// Over what was drawn before.
void Draw(const v1alpha1::ListJobsResponse& now, int* drawn) {
  std::string text = *drawn > 0 ? fmt::format("\x1b[{}A\x1b[J", *drawn) : "";
  const int columns = Columns();
  *drawn = 1;
  text += fmt::format("{:<16} {:<12} {:<26} {:>8}  {}", "job", "state", "stage", "ETA", "what")
              .substr(0, static_cast<std::size_t>(columns)) +
          "\n";
  for (const Job& job : now.jobs()) {
    text += JobLine(job, columns) + "\n";
    ++*drawn;
  }
  fmt::print("{}", text);
  std::fflush(stdout);
}

void PrintChanges(const Common& common, const v1alpha1::ListJobsResponse& now,
                  std::map<std::string, std::uint64_t>* seen) {
  for (int i = now.jobs_size(); i-- > 0;) {  // the newest stand first
    const Job& job = now.jobs(i);
    const auto found = seen->find(job.job_id());
    if (found != seen->end() && found->second == job.revision()) continue;
    (*seen)[job.job_id()] = job.revision();
    common.json ? PrintJson(job) : fmt::print("{}\n", JobLine(job, kWide));
  }
  std::fflush(stdout);
}

}  // namespace

std::string JobLine(const Job& job, int columns) {
  std::string stage;
  if (AtWork(job) && job.job_state() != v1alpha1::JOB_STATE_QUEUED) {
    const double share = std::clamp(std::isfinite(job.progress()) ? job.progress() : 0.0, 0.0, 1.0);
    const int cells = static_cast<int>(share * kBarCells);
    stage = fmt::format("{}{} {:3.0f} %", std::string(static_cast<std::size_t>(cells), '#'),
                        std::string(static_cast<std::size_t>(kBarCells - cells), '.'), 100 * share);
  }
  std::string line = Plain(fmt::format(
      "{:<16} {:<12} {:<26} {:>8}  {}{}", job.job_id(), records::ShortName(job.job_state()), stage,
      EtaOf(job), WhatOf(job), job.message().empty() ? "" : ": " + job.message()));
  if (line.size() > static_cast<std::size_t>(columns)) {
    std::size_t end = static_cast<std::size_t>(columns);
    while (end > 0 && (static_cast<unsigned char>(line[end]) & 0xc0) == 0x80)
      --end;  // whole letters
    line.resize(end);
  }
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

int WatchAll(const Common& common, int limit) {
  const client::JobsClient jobs = MakeClient(common);
  const bool table = ::isatty(STDOUT_FILENO) == 1 && !common.json;
  std::map<std::string, std::uint64_t> seen;
  for (int drawn = 0;; std::this_thread::sleep_for(kInterval)) {
    const auto now = jobs.List(limit);
    if (table) {
      Draw(now, &drawn);
    } else {
      PrintChanges(common, now, &seen);
    }
    if (std::none_of(now.jobs().begin(), now.jobs().end(), AtWork)) return kExitOk;
  }
}

}  // namespace grouser::cli
