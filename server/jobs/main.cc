// grouser-jobs: runs refinements, campaigns and calibrations.
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "proto/records/command_line.h"
#include "proto/records/os/root_folder.h"
#include "server/core/config.h"
#include "server/core/model_reference.h"
#include "server/jobs/jobs_service.h"
#include "server/net/build_info.h"
#include "server/net/config_file.h"
#include "server/net/http/operator_endpoint.h"
#include "server/net/log_settings.h"
#include "server/net/operator_service.h"
#include "server/net/service_loop.h"

namespace grouser::server {
namespace {

constexpr int kMaxReceiveBytes = 1280 * 1024;  // files of a request: 1 MiB
constexpr int kMemoryBudgetMb = 64;            // answers are below 1 MB
constexpr int kMaxCalls = 64;                  // watches last as long as their jobs

struct Settings {
  JobsOptions jobs;
  NetOptions net;
  HttpOptions http;
  LogSettings log;
  double memory_gib = 8, keep_days = 0;
  std::uint64_t max_disk_mb = 0, max_file_mb = 4096, max_job_mb = 16384;
  bool idle = false;
};

constexpr char kExamples[] = R"(
Examples:
  grouser-jobs --shipped surrogate/shipped
  grouser-jobs --state /tmp/state --grpc 127.0.0.1:0 --port-file /tmp/jobs.port

Prints "ready grpc=ADDR" to standard error when requests are taken. SIGTERM or
SIGINT answers what was sent before, refuses the rest, stops workers, leaves their
jobs resumable, and exits with 0.
Exit codes: 0 stopped, 1 failed or unreachable, 2 bad usage.)";

void Describe(CLI::App& app, Settings& s) {
  app.footer(kExamples);
  app.set_version_flag("--version", "grouser-jobs " GROUSER_VERSION);
  app.add_option("--state", s.jobs.state_dir, "State folder: jobs, runs, tiles, models")
      ->capture_default_str();
  app.add_option("--shipped", s.jobs.shipped_dir, "Folder of shipped models, only read");
  s.net.AddTo(app);
  s.http.AddTo(app);
  s.log.AddTo(app);
  app.add_option(
      "--bin", s.jobs.scheduler.bin_dir,
      "Folder of grouser-dem, grouser-fit and grouser-calibrate (default: this program's)");
  app.add_option("--workers", s.jobs.scheduler.workers, "Worker processes at a time")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--device", s.jobs.scheduler.device,
                 "Of DEM runs: cpu, cuda, or auto (a card where there is one). Without a bound of "
                 "address space but for cpu, since CUDA maps all memory there is")
      ->check(CLI::IsMember({"cpu", "cuda", "auto"}))
      ->capture_default_str();
  app.add_option(
         "--max-queued", s.jobs.max_queued,
         "Waiting jobs of one client (an identity by certificate or token, else 'local', or "
         "'anonymous@HOST' from another machine) before new ones are refused")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--memory-gib", s.memory_gib, "Address space of a worker; 0: unbounded")
      ->check(CLI::Range(0.0, 4096.0))
      ->capture_default_str();
  app.add_option("--max-disk-mb", s.max_disk_mb,
                 "Models, runs, tiles and jobs: beyond it goes, oldest first, what nothing names "
                 "any more [MB]; 0: no limit")
      ->check(CLI::Range(0.0, 1e9))
      ->capture_default_str();
  app.add_option("--keep-days", s.keep_days,
                 "What nothing names any more goes after so long, and jobs that nobody promotes "
                 "end; 0: never")
      ->check(CLI::Range(0.0, 1e5))
      ->capture_default_str();
  app.add_option("--settle-s", s.jobs.prune.settle_s, "Nothing younger than this is pruned")
      ->check(CLI::Range(0.0, 1e7))
      ->capture_default_str();
  app.add_option("--max-file-mb", s.max_file_mb, "Largest file of a worker [MB]; 0: no limit")
      ->check(CLI::Range(0.0, 1e7))
      ->capture_default_str();
  WorkOptions& work = s.jobs.scheduler.work;
  app.add_option("--max-job-mb", s.max_job_mb,
                 "Folder of a campaign or calibration [MB]: beyond it the job ends; 0: no limit")
      ->check(CLI::Range(0.0, 1e9))
      ->capture_default_str();
  app.add_option("--campaigns", work.campaigns_dir,
                 "Folder of campaigns, scenes and soils that clients may name (default: none)");
  app.add_option(
      "--scripts", work.scripts_dir,
      "Checkout of Grouser, or share/grouser of an installation, which calibrations need: its "
      "table of soils, and its Python programs (default: where this program is of one)");
  app.add_option("--work-parallel", work.parallel,
                 "Runs of a campaign, or points of a calibration of grains, at a time")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  app.add_option("--max-campaign-runs", work.max_runs, "Runs of a campaign")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--work-timeout-s", work.timeout_s,
                 "Longest campaign or calibration, of each start; 0: no limit")
      ->check(CLI::Range(0.0, 1e7))
      ->capture_default_str();
  app.add_option("--auto-promote", s.jobs.scheduler.auto_promote,
                 "Alias that a candidate which passes the gate gets by itself, such as canary; "
                 "default: a person promotes")
      ->check([](const std::string& alias) {
        return alias == kDefaultAlias || alias == kCanaryAlias ? "" : "expected stable or canary";
      });
  for (const surrogate::GateLimitField& field : surrogate::kGateLimits) {
    app.add_option(std::string("--gate-") + field.option, s.jobs.scheduler.gate.*field.value,
                   std::string("The gate's ") + field.text)
        ->check(CLI::Range(0.0, field.most))
        ->capture_default_str();
  }
  app.add_option("--nice", s.jobs.scheduler.limits.nice,
                 "Added to this program's nice value for workers")
      ->check(CLI::Range(0, 19))
      ->capture_default_str();
  app.add_flag(
      "--idle", s.idle,
      "Workers get only what processor time is left idle (SCHED_IDLE); where none is, they "
      "hardly go on, run into their time limits and end late");
  app.add_option("--grace-s", s.jobs.grace_s, "From SIGTERM to SIGKILL of a worker")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  app.add_option("--dem-timeout-s", s.jobs.scheduler.dem_timeout_s, "Longest DEM run; 0: no limit")
      ->check(CLI::Range(0.0, 1e7))
      ->capture_default_str();
  app.add_option("--fit-timeout-s", s.jobs.scheduler.fit_timeout_s, "Longest fit; 0: no limit")
      ->check(CLI::Range(0.0, 1e7))
      ->capture_default_str();
}

/// Files must never land on 0, 1 or 2, where workers' pipes are put.
void KeepStdioOpen() {
  while (true) {
    const int fd = ::open("/dev/null", O_RDWR | O_CLOEXEC);
    if (fd < 0 || fd > STDERR_FILENO) {
      if (fd >= 0) ::close(fd);
      return;
    }
    ::fcntl(fd, F_SETFD, 0);
  }
}

v1alpha1::GetBuildInfoResponse MakeJobsBuildInfo() {
  auto build = MakeBuildInfo("grouser-jobs");
  auto* store = build.add_formats();
  store->set_name("job store");
  store->set_version(JobStore::kSchemaVersion);
  return build;
}

int Serve(Settings settings) {
  namespace fs = std::filesystem;
  auto& scheduler = settings.jobs.scheduler;
  const fs::path here = fs::read_symlink("/proc/self/exe").parent_path();
  scheduler.bin_dir =
      scheduler.bin_dir.empty() ? here.string() : fs::absolute(scheduler.bin_dir).string();
  const bool bounded = scheduler.device == "cpu";
  scheduler.limits.memory_bytes =
      bounded ? static_cast<std::uint64_t>(settings.memory_gib * (1 << 30)) : 0;
  constexpr std::uint64_t kMegabyte = 1'000'000;
  scheduler.limits.file_bytes = settings.max_file_mb * kMegabyte;
  scheduler.limits.idle = settings.idle;
  WorkOptions& work = scheduler.work;
  work.max_job_bytes = settings.max_job_mb * kMegabyte;
  if (!work.campaigns_dir.empty()) work.campaigns_dir = fs::absolute(work.campaigns_dir).string();
  if (work.scripts_dir.empty()) {
    work.scripts_dir = os::RootOfProgram().string();
  } else {
    work.scripts_dir = fs::absolute(work.scripts_dir).string();
  }
  // Where calibrations look for published soils; before there are threads.
  if (!work.scripts_dir.empty()) ::setenv("GROUSER_ROOT", work.scripts_dir.c_str(), 1);
  settings.jobs.prune.max_bytes = settings.max_disk_mb * kMegabyte;
  settings.jobs.prune.keep_s = settings.keep_days * 86400;
  if (!settings.jobs.shipped_dir.empty()) {
    settings.jobs.shipped_dir = fs::absolute(settings.jobs.shipped_dir).string();
  }
  settings.jobs.state_dir = fs::absolute(settings.jobs.state_dir).string();

  AccessPolicy policy(settings.net);
  ServiceLoop loop;
  JobsApp app(settings.jobs, loop.context());
  CallGate gate;
  gate.records().SetLog(settings.log);
  JobsServiceAdapter service(app, gate, policy);
  OperatorService operator_service(MakeJobsBuildInfo(), gate);
  const std::string jobs_name = v1alpha1::JobsService::service_full_name();
  const std::string operator_name = v1alpha1::OperatorService::service_full_name();
  // Listening comes before workers start: a port in use must cost nobody a run.
  GrpcServer server(settings.net, {{&service, jobs_name}, {&operator_service, operator_name}}, gate,
                    policy, [&loop] { loop.Fail(); });
  std::unique_ptr<OperatorEndpoint> endpoint;
  if (!settings.http.http.empty()) {
    OperatorView view{[&app](auto tell) { app.TellReadiness(std::move(tell)); },
                      [&app](auto tell) { app.TellMetrics(std::move(tell)); },
                      [&loop] { return loop.draining(); },
                      [&policy](const auto& path, const auto& request) {
                        return AdmitOverHttp(policy, path, request);
                      },
                      operator_service.build()};
    endpoint = std::make_unique<OperatorEndpoint>(
        loop.context(), settings.http, server, gate,
        std::vector<std::string>{jobs_name, operator_name}, std::move(view));
  }
  app.Start();
  const std::string at = endpoint ? endpoint->address() : "";
  const int code = loop.Run(
      server, settings.net.port_file,
      [&](const auto& announce) {
        announce("ready grpc=" + server.address() + (at.empty() ? "" : " http=" + at));
      },
      [&app](auto done) { app.Stop(std::move(done)); }, at);
  endpoint.reset();
  server.Close();
  return code;
}

}  // namespace
}  // namespace grouser::server

int main(int argc, char** argv) {
  using namespace grouser::server;
  KeepStdioOpen();
  ::signal(SIGPIPE, SIG_IGN);
  Settings settings;
  settings.jobs.state_dir = DefaultStateDir();
  settings.net.grpc = "127.0.0.1:50152";
  settings.net.max_receive_bytes = kMaxReceiveBytes;
  settings.net.memory_budget_mb = kMemoryBudgetMb;
  settings.net.max_calls = kMaxCalls;
  CLI::App cli(
      "Runs jobs: refinements (a fresh DEM run, a refit, a gated candidate), campaigns of "
      "wheel tests, calibrations of soils and of grains.",
      "grouser-jobs");
  Describe(cli, settings);
  ConfigFile file("jobs");
  file.AddTo(cli);
  grouser::records::RefuseNaN(cli);
  grouser::records::DescribeOnDemand(cli);
  try {
    cli.parse(argc, argv);
    settings.http.Validate();
    settings.net.Validate();
  } catch (const CLI::ParseError& e) {
    return cli.exit(e, std::cout, std::cerr) == 0 ? 0 : 2;
  } catch (const std::invalid_argument& e) {
    std::fprintf(stderr, "grouser-jobs: %s\n", e.what());
    return 2;
  }
  if (settings.jobs.state_dir.empty()) {
    std::fprintf(stderr, "grouser-jobs: --state: empty, expected a folder\n");
    return 2;
  }
  if (std::string text; file.Answer(cli, &text)) {
    std::fputs(text.c_str(), stdout);
    return 0;
  }
  settings.log.Install("grouser-jobs");
  try {
    return Serve(std::move(settings));
  } catch (const std::exception& e) {
    std::fprintf(stderr, "grouser-jobs: %s\n", e.what());
    return 1;
  }
}
