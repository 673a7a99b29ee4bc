// grouser-jobs: runs refinement jobs.
#include <fcntl.h>
#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "server/core/config.h"
#include "server/jobs/jobs_service.h"
#include "server/net/service_loop.h"

namespace grouser::server {
namespace {

constexpr int kMaxReceiveBytes = 256 * 1024;  // requests are small

struct Settings {
  JobsOptions jobs;
  NetOptions net;
  double memory_gib = 8;
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
  app.add_option("--bin", s.jobs.scheduler.bin_dir,
                 "Folder of grouser-dem and grouser-fit (default: this program's)");
  app.add_option("--workers", s.jobs.scheduler.workers, "Worker processes at a time")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--device", s.jobs.scheduler.device,
                 "Of DEM runs: cpu, cuda, or auto (a card where there is one). Without a bound of "
                 "address space but for cpu, since CUDA maps all memory there is")
      ->check(CLI::IsMember({"cpu", "cuda", "auto"}))
      ->capture_default_str();
  app.add_option("--max-queued", s.jobs.max_queued, "Waiting jobs before new ones are refused")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--memory-gib", s.memory_gib, "Address space of a worker; 0: unbounded")
      ->check(CLI::Range(0.0, 4096.0))
      ->capture_default_str();
  app.add_option("--nice", s.jobs.scheduler.limits.nice,
                 "Added to this program's nice value for workers")
      ->check(CLI::Range(0, 19))
      ->capture_default_str();
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

int Serve(Settings settings) {
  namespace fs = std::filesystem;
  auto& scheduler = settings.jobs.scheduler;
  const fs::path here = fs::read_symlink("/proc/self/exe").parent_path();
  scheduler.bin_dir =
      scheduler.bin_dir.empty() ? here.string() : fs::absolute(scheduler.bin_dir).string();
  const bool bounded = scheduler.device == "cpu";
  scheduler.limits.memory_bytes =
      bounded ? static_cast<std::uint64_t>(settings.memory_gib * (1 << 30)) : 0;
  if (!settings.jobs.shipped_dir.empty()) {
    settings.jobs.shipped_dir = fs::absolute(settings.jobs.shipped_dir).string();
  }
  settings.jobs.state_dir = fs::absolute(settings.jobs.state_dir).string();

  AccessPolicy policy(settings.net);
  ServiceLoop loop;
  JobsApp app(settings.jobs, loop.context());
  CallGate gate;
  JobsServiceAdapter service(app, gate, policy);
  // Listening comes before workers start: a port in use must cost nobody a run.
  GrpcServer server(settings.net, {{&service, v1alpha1::JobsService::service_full_name()}}, gate,
                    policy, [&loop] { loop.Fail(); });
  app.Start();
  const int code = loop.Run(server, settings.net.port_file, "ready grpc=" + server.address(),
                            [&app](auto done) { app.Stop(std::move(done)); });
  server.Close();
  return code;
}

}  // namespace
}  // namespace grouser::server

int main(int argc, char** argv) {
  using namespace grouser::server;
  KeepStdioOpen();
  ::signal(SIGPIPE, SIG_IGN);
  spdlog::set_default_logger(spdlog::stderr_color_mt("jobs"));
  spdlog::flush_on(spdlog::level::info);
  Settings settings;
  settings.jobs.state_dir = DefaultStateDir();
  settings.net.grpc = "127.0.0.1:50152";
  settings.net.max_receive_bytes = kMaxReceiveBytes;
  CLI::App cli("Runs refinement jobs: a fresh DEM run, a refit, a gated candidate.",
               "grouser-jobs");
  Describe(cli, settings);
  try {
    cli.parse(argc, argv);
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
  try {
    return Serve(std::move(settings));
  } catch (const std::exception& e) {
    std::fprintf(stderr, "grouser-jobs: %s\n", e.what());
    return 1;
  }
}
