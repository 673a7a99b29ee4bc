#pragma once

#include <chrono>
#include <cstdio>
#include <map>
#include <mutex>
#include <string>

#include "grouser/v1alpha1/campaign.pb.h"

namespace grouser::campaign {

/// One more run that is done, by what became of it.
void CountRun(v1alpha1::RunStatus run, v1alpha1::CampaignStatus* counts);

/// Where a campaign stands: counts, rate, expected time to go. Thread-safe.
/// Prints one line per finished run to `out`, and a live line between them
/// when `live`. `lines`: lines "progress FRACTION eta=SECONDS STAGE" as well, at most one a second
/// between finished runs, for a program that follows.
class CampaignProgress {
 public:
  CampaignProgress(std::FILE* out, bool live, bool lines = false)
      : out_(out), live_(live), lines_(lines) {}

  void Start(const std::string& name, int total, int already_done);
  /// A run that was found finished.
  void Resumed(v1alpha1::RunStatus status);
  /// Stage and fraction of a run in progress; `run_id` keys it.
  void Working(const std::string& run_id, double fraction, const std::string& stage);
  void Finished(const v1alpha1::PlannedRun& run, const v1alpha1::RunRecord& record);
  void Finished(const std::string& run_id, const std::string& what,
                const v1alpha1::RunRecord& record);
  void Say(const std::string& line);
  v1alpha1::CampaignStatus Status() const;

 private:
  using Clock = std::chrono::steady_clock;
  double EtaLocked() const;   // NaN: unknown
  double RateLocked() const;  // runs per second, 0: unknown
  void PrintLocked(const std::string& line);
  void PrintLiveLocked();
  void PrintFractionLocked();

  std::FILE* out_;
  bool live_, lines_;
  mutable std::mutex mutex_;
  v1alpha1::CampaignStatus status_;
  std::map<std::string, double> working_;  // run id -> fraction of its DEM run
  int finished_here_ = 0;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_live_ = Clock::now();
};

/// Writes text and flushes; a reader that has gone away does not end the work
/// (fmt::print would throw).
void PutText(std::FILE* out, const std::string& text);

/// "1 h 02 min", "3 min 20 s", "12 s", "unknown".
std::string ForPeople(double seconds);

}  // namespace grouser::campaign
