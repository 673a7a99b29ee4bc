// grouser-server: answers wheel queries over gRPC and LCM from fitted models.
#include <malloc.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <functional>
#include <iostream>
#include <memory>
#include <thread>

#include "proto/records/command_line.h"
#include "server/net/config_file.h"
#include "server/net/http/operator_endpoint.h"
#include "server/net/log_settings.h"
#include "server/net/service_loop.h"
#include "server/query/terrain_server.h"
#include "surrogate/model_io/load_model.h"

namespace {

namespace asio = boost::asio;
using grouser::server::ConfigFile;
using grouser::server::HttpOptions;
using grouser::server::LogSettings;
using grouser::server::NetOptions;
using grouser::server::OperatorEndpoint;
using grouser::server::OperatorView;
using grouser::server::ServerConfig;
using grouser::server::ServiceLoop;
using grouser::server::TerrainServer;

constexpr int kExitOk = 0;
constexpr int kExitFailed = 1;
constexpr int kExitUsage = 2;

constexpr const char* kExamples =
    "Examples:\n"
    "  grouser-server --state ~/.local/state/grouser --shipped surrogate/shipped\n"
    "  grouser-server --state /tmp/s --grpc 127.0.0.1:0 --no-lcm --port-file /tmp/s/port\n"
    "  grouser-server --grpc unix:/run/user/1000/grouser\n"
    "  grouser-server --shipped surrogate/shipped --vehicles surrogate/vehicle/shipped\n"
    "  grouser-server --http 127.0.0.1:50161 --log-format json\n"
    "  grouser-server --query-log /var/log/grouser/queries --query-log-limit-mb 1000\n"
    "Prints 'ready grpc=ADDR lcm=URL generation=G' to stderr once it answers (and http=ADDR).\n"
    "SIGTERM or SIGINT: answers what was sent before, refuses the rest, then exits 0.\n"
    "Exit codes: 0 stopped, 1 failed or unreachable, 2 bad usage.";

/// Loads the models on the store thread, then polls the repository, one refresh at a time, until
/// told to stop.
class RefreshTimer {
 public:
  RefreshTimer(ServiceLoop& loop, std::chrono::milliseconds period, TerrainServer& server)
      : loop_(loop), timer_(loop.context()), period_(period), server_(server) {}

  /// `loaded` is called on the store thread.
  void Load(std::function<void()> loaded) {
    asio::post(store_thread_, [this, loaded] {
      try {
        server_.Load();
      } catch (const std::exception& e) {
        spdlog::error("grouser-server: {}", e.what());
        return loop_.Fail();
      }
      loaded();
      asio::post(loop_.context(), [this] { Wait(); });
    });
  }
  void Stop() {
    server_.StopLoading();
    timer_.cancel();
    store_thread_.join();
  }

 private:
  void Wait() {
    timer_.expires_after(period_);
    timer_.async_wait([this](const boost::system::error_code& error) {
      if (error) return;
      asio::post(store_thread_, [this] {
        server_.Refresh();
        asio::post(loop_.context(), [this] { Wait(); });
      });
    });
  }

  ServiceLoop& loop_;
  asio::steady_timer timer_;
  std::chrono::milliseconds period_;
  TerrainServer& server_;
  asio::thread_pool store_thread_{1};
};

int Serve(ServerConfig config, const NetOptions& net, const HttpOptions& http,
          const LogSettings& log) {
  const auto period = config.poll_period;
  ServiceLoop loop;
  TerrainServer server(std::move(config), grouser::surrogate::MakeModel);
  server.gate().records().SetLog(log);
  server.Start(net, [&loop] { loop.Fail(); });
  std::unique_ptr<OperatorEndpoint> endpoint;
  if (!http.http.empty()) {
    OperatorView view{[&server](const auto& tell) { tell(server.WhyNotReady()); },
                      [&server](const auto& tell) { tell(server.Metrics()); },
                      [&loop] { return loop.draining(); },
                      [&server](const auto& path, const auto& request) {
                        return AdmitOverHttp(server.policy(), path, request);
                      },
                      server.build()};
    endpoint =
        std::make_unique<OperatorEndpoint>(loop.context(), http, server.grpc(), server.gate(),
                                           TerrainServer::ServiceNames(), std::move(view));
  }
  RefreshTimer refresh(loop, period, server);
  const std::string at = endpoint ? endpoint->address() : "";
  const int code = loop.Run(
      server.grpc(), net.port_file,
      [&](const auto& announce) {
        refresh.Load([&server, at, announce] {
          announce(server.ReadyLine() + (at.empty() ? "" : " http=" + at));
        });
      },
      [](const auto& done) { done(); }, at);
  refresh.Stop();
  endpoint.reset();
  server.grpc().Close();
  return code;
}

/// Keeps the megabytes of big messages in the heap instead of returning them to
/// the kernel after each: page faults would cost more than the answer.
void KeepBigBuffers() {
  constexpr int kBytes = 64 * 1024 * 1024;
  mallopt(M_MMAP_THRESHOLD, kBytes / 2);
  mallopt(M_TRIM_THRESHOLD, kBytes);
}

/// Whether the command line asks for LCM against a no-lcm of the file. Throws
/// std::invalid_argument where it asks for both.
bool LcmWanted(const CLI::App& app, const ConfigFile& file) {
  const auto given = [&](const std::string& name) {
    return app.count("--" + name) > 0 && !file.Gave(name);
  };
  for (const std::string option : {"lcm-url", "lcm-interface"}) {
    if (!given(option)) continue;
    if (file.Gave("no-lcm")) return true;
    throw std::invalid_argument("--no-lcm with --" + option + ", expected one of them");
  }
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Terrain queries over gRPC and LCM: wheel states in, forces with intervals out. Vehicles "
      "over "
      "gRPC: motions and paths in, loads, power and speeds out."};
  app.footer(kExamples);
  app.set_version_flag("--version", "grouser-server " GROUSER_VERSION);
  ServerConfig config;
  NetOptions net;
  HttpOptions http;
  LogSettings log;
  net.grpc = "127.0.0.1:50151";
  config.state_dir = grouser::server::DefaultStateDir();
  bool no_lcm = false;
  app.add_option("--state", config.state_dir, "State folder; its models/ is served")
      ->capture_default_str();
  app.add_option("--shipped", config.shipped_dir, "Folder of shipped models, read only");
  config.vehicle_threads =
      grouser::server::DefaultVehicleThreads(std::thread::hardware_concurrency());
  app.add_option(
         "--vehicles", config.vehicles,
         "Vehicle files, and folders of *.vehicle.yaml (default: none); what cannot be read is "
         "named and left out")
      ->expected(1, -1);
  app.add_option(
         "--vehicle-threads", config.vehicle_threads,
         "Threads that solve and plan for vehicles, 1 to 64; default: half of the processors")
      ->capture_default_str();
  app.add_option("--table-cache-mb", config.table_cache_mb,
                 "Most megabytes of models' tables that are kept in the state folder's tables/ for "
                 "the next start; 0: none")
      ->capture_default_str();
  app.add_option("--query-log", config.query_log,
                 "File that answered wheel queries of gRPC are logged to, for grouser-replay "
                 "(default: none): what clients asked and were answered");
  app.add_option("--query-log-limit-mb", config.query_log_limit_mb,
                 "Most megabytes of the file; then it becomes FILE.1, FILE.1 becomes FILE.2, ...")
      ->capture_default_str();
  app.add_option("--query-log-files", config.query_log_files,
                 "How many files are kept, the one that is written among them")
      ->capture_default_str();
  net.AddTo(app);
  http.AddTo(app);
  log.AddTo(app);
  app.add_flag("--no-lcm", no_lcm, "Serve gRPC alone");
  app.add_option("--lcm-url", config.lcm_url, "LCM URL (default: $LCM_DEFAULT_URL)");
  app.add_option("--lcm-interface", config.lcm_interface,
                 "Network interface that LCM queries are received on, such as eth0; lo: from this "
                 "machine alone")
      ->capture_default_str();
  ConfigFile file("server");
  file.AddTo(app);
  std::string settings;
  grouser::records::RefuseNaN(app);
  grouser::records::DescribeOnDemand(app);
  try {
    app.parse(argc, argv);
    config.lcm = !no_lcm || LcmWanted(app, file);
    config.Validate();
    http.Validate();
    net.Validate();
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitOk : kExitUsage;
  } catch (const std::invalid_argument& e) {
    std::cerr << "grouser-server: " << e.what() << "\n";
    return kExitUsage;
  }
  if (file.Answer(app, &settings)) {
    std::cout << settings;
    return kExitOk;
  }
  log.Install("grouser-server");
  KeepBigBuffers();
  try {
    return Serve(std::move(config), net, http, log);
  } catch (const std::exception& e) {
    std::cerr << "grouser-server: " << e.what() << "\n";
    return kExitFailed;
  }
}
