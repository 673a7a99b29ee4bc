// grouser-server: answers wheel queries over gRPC and LCM from fitted models.
#include <malloc.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <csignal>
#include <iostream>
#include <utility>  // before Asio: 1.74 under C++20

#include "server/query/terrain_server.h"
#include "surrogate/model_io/load_model.h"

namespace {

namespace asio = boost::asio;
using grouser::server::ServerConfig;
using grouser::server::TerrainServer;

constexpr int kExitOk = 0;
constexpr int kExitFailed = 1;
constexpr int kExitUsage = 2;

constexpr const char* kExamples =
    "Examples:\n"
    "  grouser-server --state ~/.local/state/grouser --shipped surrogate/shipped\n"
    "  grouser-server --state /tmp/s --grpc 127.0.0.1:0 --no-lcm --port-file /tmp/s/port\n"
    "Prints 'ready grpc=ADDR lcm=URL generation=G' to stderr once it answers.\n"
    "SIGTERM or SIGINT: answers what is under way, then exits 0.";

/// Polls the repository on the store thread, one refresh at a time, until told
/// to stop.
class RefreshTimer {
 public:
  RefreshTimer(asio::io_context& loop, std::chrono::milliseconds period, TerrainServer& server)
      : loop_(loop), timer_(loop), period_(period), server_(server) {}

  void Start() {
    timer_.expires_after(period_);
    timer_.async_wait([this](const boost::system::error_code& error) {
      if (error) return;
      asio::post(store_thread_, [this] {
        server_.Refresh();
        asio::post(loop_, [this] { Start(); });
      });
    });
  }
  void Stop() {
    timer_.cancel();
    store_thread_.join();
  }

 private:
  asio::io_context& loop_;
  asio::steady_timer timer_;
  std::chrono::milliseconds period_;
  TerrainServer& server_;
  asio::thread_pool store_thread_{1};
};

void Serve(ServerConfig config) {
  const auto period = config.poll_period;
  asio::io_context loop;
  // Before any thread: a signal during start-up must not be lost.
  asio::signal_set signals(loop, SIGINT, SIGTERM);
  TerrainServer server(std::move(config), grouser::surrogate::MakeModel);
  server.Start();
  RefreshTimer refresh(loop, period, server);
  refresh.Start();
  signals.async_wait([&loop](const boost::system::error_code& error, int number) {
    if (error) return;
    spdlog::info("{}: draining", number == SIGINT ? "SIGINT" : "SIGTERM");
    loop.stop();
  });
  std::cerr << server.ReadyLine() << std::endl;
  loop.run();
  refresh.Stop();
  server.Stop();
}

/// Keeps the megabytes of big messages in the heap instead of returning them to
/// the kernel after each: page faults would cost more than the answer.
void KeepBigBuffers() {
  constexpr int kBytes = 64 * 1024 * 1024;
  mallopt(M_MMAP_THRESHOLD, kBytes / 2);
  mallopt(M_TRIM_THRESHOLD, kBytes);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Terrain queries over gRPC and LCM: wheel states in, forces with intervals out."};
  app.footer(kExamples);
  ServerConfig config;
  config.state_dir = grouser::server::DefaultStateDir();
  bool no_lcm = false;
  app.add_option("--state", config.state_dir, "State folder; its models/ is served")
      ->capture_default_str();
  app.add_option("--shipped", config.shipped_dir, "Folder of shipped models, read only");
  app.add_option("--grpc", config.grpc_address, "HOST:PORT to listen on; port 0 takes a free one")
      ->capture_default_str();
  auto* without = app.add_flag("--no-lcm", no_lcm, "Serve gRPC alone");
  app.add_option("--lcm-url", config.lcm_url, "LCM URL (default: $LCM_DEFAULT_URL)")
      ->excludes(without);
  app.add_option("--lcm-interface", config.lcm_interface,
                 "Network interface that LCM queries are received on, such as eth0; lo: from this "
                 "machine alone")
      ->excludes(without)
      ->capture_default_str();
  app.add_option("--port-file", config.port_file, "File that receives grpc=ADDR when ready");
  try {
    app.parse(argc, argv);
    config.lcm = !no_lcm;
    config.Validate();
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitOk : kExitUsage;
  } catch (const std::invalid_argument& e) {
    std::cerr << "grouser-server: " << e.what() << "\n";
    return kExitUsage;
  }
  spdlog::set_default_logger(spdlog::stderr_logger_mt("grouser-server"));
  KeepBigBuffers();
  try {
    Serve(std::move(config));
  } catch (const std::exception& e) {
    std::cerr << "grouser-server: " << e.what() << "\n";
    return kExitFailed;
  }
  return kExitOk;
}
