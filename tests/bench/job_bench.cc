#include "tests/bench/job_bench.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <thread>
#include <utility>

#include "clients/cpp/terrain_client.h"
#include "server/jobs/worker_process.h"
#include "tests/bench/server_bench.h"
#include "tests/bench/surrogate_bench.h"

namespace grouser::bench {
namespace {

using Clock = std::chrono::steady_clock;
using server::WorkerProcess;

constexpr std::chrono::microseconds kPeriod(1000);
constexpr double kLateUs = 1000;
constexpr std::chrono::seconds kTurn(1);
constexpr char kScene[] = "dem_offline/campaigns/cmu_smooth.scene.yaml";

struct Means {
  const char* text;
  int jobs;            // -k: k - 1 less than cores
  bool idle;           // SCHED_IDLE, else nice 10
  int core, job_core;  // -1: any
  enum { kNone, kEcho, kOtherCore } target;
};
constexpr double kOtherCoreShare = 0.005;
constexpr Means kMeans[] = {
    {"no job", 0, false, -1, -1, Means::kNone},
    {"a job on each core, nice 10", -1, false, -1, -1, Means::kNone},
    {"a job on each core, idle priority", -1, true, -1, -1, Means::kEcho},
    {"a core less for jobs, idle priority", -2, true, -1, -1, Means::kEcho},
    {"all on one core, job of nice 10", 1, false, 0, 0, Means::kNone},
    {"all on one core, job of idle priority", 1, true, 0, 0, Means::kEcho},
    {"job on another core, idle priority", 1, true, 0, 1, Means::kOtherCore},
};

/// DEM runs, or programs that spin, as grouser-jobs starts its workers.
class Jobs {
 public:
  Jobs(const Means& means, const TempFolder& folder) : means_(means), folder_(folder) {
    const int cores = static_cast<int>(std::thread::hardware_concurrency());
    const int count = means.jobs >= 0 ? means.jobs : std::max(cores + 1 + means.jobs, 1);
    for (int i = 0; i < count; ++i) workers_.push_back(Start(workers_.size()));
  }

  /// A run that is done is followed by another. Throws where one failed.
  void GoOn() {
    for (std::size_t i = 0; i < workers_.size(); ++i) {
      pollfd ended{workers_[i]->pidfd(), POLLIN, 0};
      if (::poll(&ended, 1, 0) == 0) continue;
      const auto end = workers_[i]->Reap();
      if (!end.Exited(0)) {
        std::ifstream in(folder_ / fmt::format("log{}", i));
        throw std::runtime_error("the job " + end.Text() + ": " +
                                 std::string(std::istreambuf_iterator<char>(in), {}));
      }
      workers_[i] = Start(i);
    }
  }

  static bool HasDem() { return std::filesystem::exists(Beside("grouser-dem")); }
  static std::string Name() {
    return HasDem() ? std::string("grouser-dem run --scene ") + kScene
                    : "a spinning shell (no grouser-dem is built)";
  }

 private:
  std::unique_ptr<WorkerProcess> Start(std::size_t i) {
    server::WorkerCommand command;
    if (HasDem()) {
      command.argv = {Beside("grouser-dem"),
                      "run",
                      "--scene",
                      FindShipped(kScene),
                      "--slip",
                      "0.2",
                      "--load",
                      "24",
                      "--seed",
                      std::to_string(++seed_),
                      "--out",
                      folder_ / fmt::format("{}.run.h5", i)};
    } else {
      command.argv = {"/bin/sh", "-c", "while :; do :; done"};
    }
    if (means_.job_core >= 0) {
      const std::string core = std::to_string(means_.job_core);
      command.argv.insert(command.argv.begin(), {"/usr/bin/taskset", "-c", core});
    }
    command.folder = folder_ / "";
    command.stdout_path = folder_ / fmt::format("out{}", i);
    command.log_path = folder_ / fmt::format("log{}", i);
    command.limits.idle = means_.idle;
    return std::make_unique<WorkerProcess>(WorkerProcess::Spawn(std::move(command)));
  }

  const Means& means_;
  const TempFolder& folder_;
  int seed_ = 0;
  std::vector<std::unique_ptr<WorkerProcess>> workers_;
};

/// One peer's stream.
class PacedStream {
 public:
  PacedStream(const std::string& address, const v1alpha1::EvaluateWheelsRequest& request)
      : client_(address), stream_(client_.OpenStream()), request_(request) {
    Call();
  }

  /// For a while, a message each millisecond; those that are due while one is under way are left
  /// out.
  void Turn() {
    const auto end = Clock::now() + kTurn;
    for (auto next = Clock::now() + kPeriod; next < end; next += kPeriod) {
      if (next < Clock::now()) continue;
      std::this_thread::sleep_until(next);
      const auto start = Clock::now();
      Call();
      const std::chrono::duration<double, std::micro> spent = Clock::now() - start;
      microseconds_.push_back(spent.count());
    }
  }

  void Summarise(double* share, double* p99_us) {
    stream_->Finish();
    std::sort(microseconds_.begin(), microseconds_.end());
    const auto late = std::ranges::upper_bound(microseconds_, kLateUs);
    *share = static_cast<double>(microseconds_.end() - late) / static_cast<double>(count());
    *p99_us = Quantile(microseconds_, 0.99);
  }
  std::size_t count() const { return microseconds_.size(); }

 private:
  void Call() {
    if (!stream_->Send(request_) || !stream_->Receive(&response_)) {
      stream_->Finish();
      throw std::runtime_error("the stream ended early");
    }
    if (response_.has_error()) throw std::runtime_error(response_.error().message());
  }

  client::TerrainClient client_;
  std::unique_ptr<client::WheelStreamSession> stream_;
  const v1alpha1::EvaluateWheelsRequest& request_;
  v1alpha1::EvaluateWheelsResponse response_;
  std::vector<double> microseconds_;
};

JobRow Measure(const Means& means, const JobOptions& options, int states) {
  const TempFolder folder;
  auto words = ServerWords(folder, options.program);
  words.push_back("--no-lcm");
  const ChildProgram server(words, "127.0.0.1:0", means.core);
  const auto request = RandomRequest(server.address(), states, options.seed);
  SaveAnswer(server.address(), request, folder / "");
  const ChildProgram echo(EchoWords(folder / ""), "127.0.0.1:0", means.core);
  const Pinned pinned(means.core);
  PacedStream to_server(server.address(), request), to_echo(echo.address(), request);
  Jobs jobs(means, folder);
  const auto until = Clock::now() + std::chrono::duration<double>(2 * options.seconds);
  do {
    to_server.Turn();
    to_echo.Turn();
    jobs.GoOn();
  } while (Clock::now() < until);
  JobRow row;
  row.means = means.text;
  row.samples = to_server.count();
  to_server.Summarise(&row.share, &row.p99_us);
  to_echo.Summarise(&row.echo_share, &row.echo_p99_us);
  if (means.target == Means::kEcho) row.target = row.echo_share;
  if (means.target == Means::kOtherCore) row.target = kOtherCoreShare;
  return row;
}

}  // namespace

JobResult MeasureWithJob(const JobOptions& options) {
  JobResult result;
  result.job = Jobs::Name();
  for (const Means& means : kMeans) {
    const int cores = static_cast<int>(std::thread::hardware_concurrency());
    if (means.job_core >= cores) continue;
    result.rows.push_back(Measure(means, options, result.states));
  }
  return result;
}

}  // namespace grouser::bench
