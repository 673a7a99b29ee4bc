#include "dem_offline/campaign/progress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dem_offline/campaign/design.h"

namespace grouser::campaign {
namespace {

std::string Means(const v1alpha1::RunRecord& record) {
  std::string text;
  for (const auto& output : record.outputs()) {
    const std::string& name = output.name();
    if (name == "f_x" || name == "f_y" || name == "f_z") {
      text += fmt::format(" {} {:.2f}±{:.2f} N", name, output.mean(), output.standard_error());
    } else if (name == "torque") {
      text += fmt::format(" torque {:.3f}±{:.3f} N m", output.mean(), output.standard_error());
    } else if (name == "sinkage") {
      text += fmt::format(" sinkage {:.1f}±{:.1f} mm", 1000 * output.mean(),
                          1000 * output.standard_error());
    }
  }
  return text;
}

std::string StatusWord(v1alpha1::RunStatus status) {
  return v1alpha1::RunStatus_Name(status).substr(sizeof("RUN_STATUS_") - 1);
}

std::string RoleWord(v1alpha1::RunRole role) {
  return v1alpha1::RunRole_Name(role).substr(sizeof("RUN_ROLE_") - 1);
}

}  // namespace

void PutText(std::FILE* out, const std::string& text) {
  std::fputs(text.c_str(), out);
  std::fflush(out);
}

void CountRun(v1alpha1::RunStatus run, v1alpha1::CampaignStatus* counts) {
  counts->set_done(counts->done() + 1);
  if (run == v1alpha1::RUN_STATUS_STEADY) counts->set_steady(counts->steady() + 1);
  if (run == v1alpha1::RUN_STATUS_UNSTEADY) counts->set_unsteady(counts->unsteady() + 1);
  if (run == v1alpha1::RUN_STATUS_OVERLOAD) counts->set_overload(counts->overload() + 1);
  if (run == v1alpha1::RUN_STATUS_FAILED) counts->set_failed(counts->failed() + 1);
  if (run == v1alpha1::RUN_STATUS_LOST) counts->set_lost(counts->lost() + 1);
}

std::string ForPeople(double seconds) {
  if (!std::isfinite(seconds)) return "unknown";
  const long s = std::lround(seconds);
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {:02} s", s / 60, s % 60);
  return fmt::format("{} h {:02} min", s / 3600, s / 60 % 60);
}

void CampaignProgress::Start(const std::string& name, int total, int already_done) {
  const std::lock_guard lock(mutex_);
  status_.set_name(name);
  status_.set_total(static_cast<std::uint32_t>(total));
  start_ = Clock::now();
  PrintLocked(already_done > 0 ? fmt::format("campaign {}: {} runs, {} of them finished before",
                                             name, total, already_done)
                               : fmt::format("campaign {}: {} runs", name, total));
}

void CampaignProgress::Resumed(v1alpha1::RunStatus status) {
  const std::lock_guard lock(mutex_);
  CountRun(status, &status_);
}

void CampaignProgress::Working(const std::string& run_id, double fraction,
                               const std::string& stage) {
  const std::lock_guard lock(mutex_);
  working_[run_id] = stage == "run" ? fraction : 0.0;
  const auto since = Clock::now() - last_live_;
  if (live_ && since > std::chrono::milliseconds(500)) PrintLiveLocked();
  if (lines_ && since > std::chrono::seconds(1)) PrintFractionLocked();
}

void CampaignProgress::Finished(const v1alpha1::PlannedRun& run,
                                const v1alpha1::RunRecord& record) {
  Finished(run.run_id(),
           fmt::format("{} {}", RoleWord(run.role()), Describe(run.state(), run.seed())), record);
}

void CampaignProgress::Finished(const std::string& run_id, const std::string& what,
                                const v1alpha1::RunRecord& record) {
  const std::lock_guard lock(mutex_);
  working_.erase(run_id);
  CountRun(record.status(), &status_);
  ++finished_here_;
  std::string line = fmt::format("[{}/{}] {} {}: {}{}", status_.done(), status_.total(), run_id,
                                 what, StatusWord(record.status()), Means(record));
  if (!record.reason().empty()) line += fmt::format(" ({})", record.reason());
  PrintLocked(line + fmt::format("; {}; {:.2f} runs/min, ETA {}",
                                 ForPeople(record.numerics().wall_s()), 60 * RateLocked(),
                                 ForPeople(EtaLocked())));
  if (lines_) PrintFractionLocked();
}

void CampaignProgress::Say(const std::string& line) {
  const std::lock_guard lock(mutex_);
  PrintLocked(line);
}

v1alpha1::CampaignStatus CampaignProgress::Status() const {
  const std::lock_guard lock(mutex_);
  v1alpha1::CampaignStatus status = status_;
  status.set_eta_s(EtaLocked());
  return status;
}

double CampaignProgress::RateLocked() const {
  double work = finished_here_;
  for (const auto& [id, fraction] : working_) work += fraction;
  const double elapsed = std::chrono::duration<double>(Clock::now() - start_).count();
  return elapsed > 0 ? work / elapsed : 0.0;
}

double CampaignProgress::EtaLocked() const {
  double remaining = static_cast<double>(status_.total()) - status_.done();
  for (const auto& [id, fraction] : working_) remaining -= fraction;
  if (status_.done() == status_.total()) return 0.0;
  const double rate = RateLocked();
  return rate > 0 ? remaining / rate : std::numeric_limits<double>::quiet_NaN();
}

void CampaignProgress::PrintLocked(const std::string& line) {
  PutText(out_, (live_ ? "\r\x1b[K" : "") + line + "\n");
}

void CampaignProgress::PrintFractionLocked() {
  last_live_ = Clock::now();
  double work = status_.done();
  for (const auto& [id, fraction] : working_) work += fraction;
  const double eta = EtaLocked();
  PutText(out_, fmt::format("progress {:.4f}{} {} of {} runs\n",
                            status_.total() > 0 ? std::min(1.0, work / status_.total()) : 0.0,
                            std::isfinite(eta) ? fmt::format(" eta={:.0f}", eta) : "",
                            status_.done(), status_.total()));
}

void CampaignProgress::PrintLiveLocked() {
  last_live_ = Clock::now();
  PutText(out_, fmt::format("\r\x1b[K{}/{} done, {} running, ETA {}", status_.done(),
                            status_.total(), working_.size(), ForPeople(EtaLocked())));
}

}  // namespace grouser::campaign
