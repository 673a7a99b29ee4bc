#include "clients/cli/job_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "proto/records/message_json.h"

namespace grouser::cli {
namespace {

using v1alpha1::Job;

constexpr int kBarCells = 10;

std::string WhatOf(const Job& job) {
  if (job.has_campaign()) return "campaign " + job.campaign().file();
  if (job.has_calibration()) return "calibration from " + job.calibration().data();
  return "refines " + job.model().substr(0, job.model().find('@'));
}

std::string EtaOf(const Job& job) {
  if (!job.has_eta()) return "";
  const auto s = job.eta().seconds();
  return s < 3600 ? fmt::format("{}:{:02}", s / 60, s % 60)
                  : fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

std::string StageOf(const Job& job) {
  if (!AtWork(job) || job.job_state() == v1alpha1::JOB_STATE_QUEUED) return "";
  const double share = std::clamp(std::isfinite(job.progress()) ? job.progress() : 0.0, 0.0, 1.0);
  const auto cells = static_cast<std::size_t>(share * kBarCells);
  return fmt::format("{}{} {:3.0f} %", std::string(cells, '#'), std::string(kBarCells - cells, '.'),
                     100 * share);
}

/// A text of the server without characters that move a cursor: C0, DEL, and C1 as UTF-8.
std::string Plain(std::string text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const auto next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0;
    if (c < ' ' || c == 0x7f) text[i] = ' ';
    if (c == 0xc2 && next >= 0x80 && next < 0xa0) text[i] = text[i + 1] = ' ';
  }
  return text;
}

std::string Row(const std::string& job, const std::string& state, const std::string& stage,
                const std::string& eta, const std::string& what, int columns) {
  std::string line =
      Plain(fmt::format("{:<20} {:<18} {:<16} {:>8}  {}", job, state, stage, eta, what));
  if (line.size() > static_cast<std::size_t>(columns)) {
    auto end = static_cast<std::size_t>(columns);
    while (end > 0 && (static_cast<unsigned char>(line[end]) & 0xc0) == 0x80)
      --end;  // whole letters
    line.resize(end);
  }
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

}  // namespace

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

std::string JobLine(const Job& job, int columns) {
  return Row(job.job_id(), records::ShortName(job.job_state()), StageOf(job), EtaOf(job),
             WhatOf(job) + (job.message().empty() ? "" : ": " + job.message()), columns);
}

std::string JobTable(const v1alpha1::ListJobsResponse& jobs, int columns, int rows) {
  std::string text = Row("job", "state", "stage", "ETA", "what", columns) + "\n";
  const int all = jobs.jobs_size();
  const int shown = all + 1 <= rows ? all : std::max(0, rows - 2);
  for (int i = 0; i < shown; ++i) text += JobLine(jobs.jobs(i), columns) + "\n";
  if (shown < all) text += Row(fmt::format("{} more", all - shown), "", "", "", "", columns) + "\n";
  return text;
}

}  // namespace grouser::cli
