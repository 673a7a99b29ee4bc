#include "clients/cli/watch_jobs.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <thread>

#include "clients/cli/job_options.h"
#include "clients/cli/job_table.h"
#include "clients/cli/print.h"

namespace grouser::cli {
namespace {

using v1alpha1::Job;

constexpr auto kInterval = std::chrono::seconds(2);
constexpr int kWide = 200, kNarrow = 80, kLow = 24;

/// Over what was drawn before.
void Draw(const v1alpha1::ListJobsResponse& now, std::ptrdiff_t* drawn) {
  winsize size{};
  const bool known = ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col >= 20;
  const int columns = known ? std::min<int>(size.ws_col, kWide) : kNarrow;
  const int rows = known && size.ws_row > 3 ? size.ws_row - 1 : kLow - 1;
  const std::string table = JobTable(now, columns, rows);
  if (*drawn > 0) fmt::print("\x1b[{}A\x1b[J", *drawn);
  *drawn = std::count(table.begin(), table.end(), '\n');
  fmt::print("{}", table);
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

int WatchAll(const Common& common, int limit) {
  const client::JobsClient jobs = MakeClient(common);
  const bool table = ::isatty(STDOUT_FILENO) == 1 && !common.json;
  std::map<std::string, std::uint64_t> seen;
  for (std::ptrdiff_t drawn = 0;; std::this_thread::sleep_for(kInterval)) {
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
