// grouser-bench: measurements of a running system, and of models in-process.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "proto/records/command_line.h"
#include "tests/bench/echo_server.h"
#include "tests/bench/job_bench.h"
#include "tests/bench/overload_bench.h"
#include "tests/bench/planner_bench.h"
#include "tests/bench/server_bench.h"
#include "tests/bench/server_table.h"
#include "tests/bench/surrogate_bench.h"
#include "tests/bench/trajectory_bench.h"

namespace {

constexpr const char* kExamples =
    "Examples:\n"
    "  grouser-bench server\n"
    "  grouser-bench server --no-lcm --seconds 5 --json\n"
    "  grouser-bench server --with-job\n"
    "  grouser-bench surrogate --json\n"
    "  grouser-bench planner\n"
    "  grouser-bench planner --server 127.0.0.1:50151\n"
    "  grouser-bench trajectories --server 127.0.0.1:50151\n"
    "  grouser-bench overload --seconds 60\n"
    "Exit codes: 0 ok, 1 failed, 2 usage, 3 a target of overload was missed.";

void PrintTable(const std::vector<grouser::bench::SurrogateRow>& rows) {
  fmt::print("{:13} {:>6} {:>8} {:>10} {:9} {:>13} {:>12}\n", "kind", "batch", "outputs",
             "gradients", "isa", "ns per state", "allocations");
  for (const auto& row : rows) {
    fmt::print("{:13} {:>6} {:>8} {:>10} {:9} {:>13.1f} {:>12}\n", row.kind, row.batch, row.outputs,
               row.gradients, row.isa, row.ns_per_state, row.allocations);
  }
}

void PrintJson(const std::vector<grouser::bench::SurrogateRow>& rows) {
  fmt::print("[");
  const char* separator = "\n";
  for (const auto& row : rows) {
    fmt::print(
        "{}  {{\"kind\": \"{}\", \"batch\": {}, \"outputs\": {}, \"gradients\": {}, "
        "\"isa\": \"{}\", \"ns_per_state\": {:.3f}, \"allocations\": {}}}",
        separator, row.kind, row.batch, row.outputs, row.gradients, row.isa, row.ns_per_state,
        row.allocations);
    separator = ",\n";
  }
  fmt::print("\n]\n");
}

void PrintTable(const std::vector<grouser::bench::PlannerRow>& rows) {
  fmt::print("{:8} {:9} {:>6} {:>11} {:>11} {:>11} {:>13} {:>13} {:>13} {:>11} {:>8}\n", "vehicle",
             "path", "wheels", "plan p50 ms", "plan p99 ms", "plan cpu ms", "solve cold us",
             "solve warm us", "solve draw us", "allocations", "not held");
  for (const auto& r : rows) {
    fmt::print(
        "{:8} {:9} {:>6} {:>11.2f} {:>11.2f} {:>11.2f} {:>13.2f} {:>13.2f} {:>13.2f} {:>11} "
        "{:>8}\n",
        r.vehicle, r.path, r.wheels, r.plan_p50_ms, r.plan_p99_ms, r.plan_cpu_ms, r.solve_cold_us,
        r.solve_warm_us, r.solve_draw_us, r.allocations, r.not_held);
  }
  if (rows.empty() || rows.front().grpc_p50_ms == 0) return;
  fmt::print("\n{:8} {:9} {:>11} {:>11} {:>10} {:>10} {:>11}\n", "vehicle", "path", "gRPC p50 ms",
             "gRPC p99 ms", "p50 ratio", "p99 ratio", "differ");
  for (const auto& r : rows) {
    fmt::print("{:8} {:9} {:>11.2f} {:>11.2f} {:>10.2f} {:>10.2f} {:>11}\n", r.vehicle, r.path,
               r.grpc_p50_ms, r.grpc_p99_ms, r.grpc_p50_ms / r.plan_p50_ms,
               r.grpc_p99_ms / r.plan_p99_ms, r.grpc_differ);
  }
}

void PrintJson(const std::vector<grouser::bench::PlannerRow>& rows) {
  fmt::print("[");
  const char* separator = "\n";
  for (const auto& r : rows) {
    fmt::print(
        "{}  {{\"vehicle\": \"{}\", \"path\": \"{}\", \"points\": {}, \"wheels\": {}, "
        "\"plan_p50_ms\": {:.4f}, \"plan_p99_ms\": {:.4f}, \"plan_cpu_ms\": {:.4f}, "
        "\"solve_cold_us\": {:.4f}, \"solve_warm_us\": {:.4f}, \"solve_draw_us\": {:.4f}, "
        "\"allocations\": {}, "
        "\"not_held\": {}, \"grpc_p50_ms\": {:.4f}, \"grpc_p99_ms\": {:.4f}, "
        "\"grpc_differ\": {}}}",
        separator, r.vehicle, r.path, r.points, r.wheels, r.plan_p50_ms, r.plan_p99_ms,
        r.plan_cpu_ms, r.solve_cold_us, r.solve_warm_us, r.solve_draw_us, r.allocations, r.not_held,
        r.grpc_p50_ms, r.grpc_p99_ms, r.grpc_differ);
    separator = ",\n";
  }
  fmt::print("\n]\n");
}

void PrintTable(const grouser::bench::OverloadResult& result) {
  fmt::print("{:6} {:>10} {:>10} {:>10} {:>8} {:>8} {:>10} {:>8} {:>8} {:>11} {:>11} {:>8}\n",
             "load", "offered/s", "answered/s", "refused/s", "late/s", "failed/s", "held/s",
             "p50 ms", "p99 ms", "ref. p50 ms", "ref. p99 ms", "RSS MiB");
  for (const auto& r : result.rows) {
    fmt::print(
        "{:6} {:>10.0f} {:>10.0f} {:>10.0f} {:>8.0f} {:>8.0f} {:>10.0f} {:>8.2f} {:>8.2f} "
        "{:>11.2f} "
        "{:>11.2f} {:>8.0f}\n",
        r.load, r.offered_per_s, r.answered_per_s, r.refused_per_s, r.late_per_s, r.failed_per_s,
        r.held_per_s, r.p50_ms, r.p99_ms, r.refused_p50_ms, r.refused_p99_ms, r.most_rss_mib);
  }
  fmt::print(
      "goodput {:.2f} of the closed loop's, p99 {:.1f} times that at 0.8, RSS at most {:.0f} MiB, "
      "{:.0f} at the start, {:.2f} times that at the end\n",
      result.goodput, result.p99_ratio, result.most_rss_mib, result.start_rss_mib,
      result.rss_ratio);
}

void PrintJson(const grouser::bench::OverloadResult& result) {
  fmt::print("{{\"rows\": [");
  const char* separator = "\n";
  for (const auto& r : result.rows) {
    fmt::print(
        "{}  {{\"load\": \"{}\", \"offered_per_s\": {:.1f}, \"answered_per_s\": {:.1f}, "
        "\"refused_per_s\": {:.1f}, \"late_per_s\": {:.1f}, \"failed_per_s\": {:.1f}, "
        "\"held_per_s\": {:.1f}, \"p50_ms\": {:.3f}, \"p99_ms\": {:.3f}, "
        "\"refused_p50_ms\": {:.3f}, \"refused_p99_ms\": {:.3f}, \"most_rss_mib\": {:.1f}}}",
        separator, r.load, r.offered_per_s, r.answered_per_s, r.refused_per_s, r.late_per_s,
        r.failed_per_s, r.held_per_s, r.p50_ms, r.p99_ms, r.refused_p50_ms, r.refused_p99_ms,
        r.most_rss_mib);
    separator = ",\n";
  }
  fmt::print("\n], \"rss_mib\": [");
  separator = "";
  for (const double mib : result.rss_mib) {
    fmt::print("{}{:.1f}", separator, mib);
    separator = ", ";
  }
  fmt::print(
      "], \"start_rss_mib\": {:.1f}, \"end_rss_mib\": {:.1f}, \"goodput\": {:.3f}, "
      "\"p99_ratio\": {:.3f}, \"most_rss_mib\": {:.1f}, \"rss_ratio\": {:.3f}}}\n",
      result.start_rss_mib, result.end_rss_mib, result.goodput, result.p99_ratio,
      result.most_rss_mib, result.rss_ratio);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Measures a running Grouser, or its models in-process."};
  app.footer(kExamples);
  app.set_version_flag("--version", "grouser-bench " GROUSER_VERSION);
  app.require_subcommand(1);
  grouser::bench::ServerOptions options;
  bool json = false;
  bool no_lcm = false, with_job = false;
  auto* server = app.add_subcommand(
      "server",
      "Round trips to a server of its own over an echo's of the same messages, interleaved: gRPC "
      "by "
      "TCP and a Unix socket, unary and streams, and LCM; with targets, which may be missed");
  server->add_option("--program", options.program, "grouser-server; default: beside this program");
  auto* without = server->add_flag("--no-lcm", no_lcm, "gRPC alone");
  server->add_option("--lcm-interface", options.lcm_interface, "As of grouser-client lcm-query")
      ->excludes(without)
      ->capture_default_str();
  server
      ->add_option("--seconds", options.seconds,
                   "About how long to measure [s]; with --with-job: each of the means, and as long "
                   "its echo")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  server->add_option("--starts", options.starts, "Of programs, for the first big message")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  server->add_option("--seed", options.seed, "Of the random states")->capture_default_str();
  server->add_flag("--query-log", options.query_log,
                   "Instead of the echo: a server that logs its queries over one that does not");
  server->add_flag("--with-job", with_job,
                   "Instead: a stream at 1 kHz beside DEM runs, by the means that keep them from "
                   "disturbing it");
  server->add_flag("--json", json, "JSON on stdout");
  grouser::bench::EchoOptions echo_options;
  auto* echo = app.add_subcommand("echo", "What `server` compares with");
  echo->group("");
  echo->add_option("--answers", echo_options.answers)->required();
  echo->add_option("--grpc", echo_options.grpc)->required();
  echo->add_option("--port-file", echo_options.port_file)->required();
  echo->add_option("--lcm-url", echo_options.lcm_url);
  echo->add_option("--lcm-interface", echo_options.lcm_interface);
  grouser::bench::SurrogateOptions in_process;
  auto* surrogate = app.add_subcommand(
      "surrogate",
      "Evaluation of a model in-process, one thread: kinds of model, batches, gradients and "
      "instruction sets, interleaved; medians");
  surrogate->add_option("--model", in_process.model, "Model file; default: the shipped one")
      ->check(CLI::ExistingFile);
  surrogate->add_option("--repetitions", in_process.repetitions, "Of every row")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  surrogate->add_option("--seed", in_process.seed, "Of the random states")->capture_default_str();
  surrogate->add_flag("--json", json, "JSON on stdout");
  grouser::bench::PlannerOptions plans;
  auto* planner = app.add_subcommand(
      "planner",
      "Speed plans and solves of vehicles in-process, one thread: straight, curvy, "
      "hilly and mixed paths, interleaved; wall clock, and processor time where others run too");
  planner->add_option("--repetitions", plans.repetitions, "Of every row")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  planner->add_option("--vehicle", plans.vehicle, "Its rows alone: husky, cart, atv, rover");
  planner->add_option("--path", plans.path, "Its rows alone: straight, curvy, hilly, mixed");
  planner->add_option("--server", plans.server,
                      "grouser-server with the shipped vehicles, HOST:PORT: it plans the same by "
                      "turns");
  planner->add_option("--points", plans.points, "Of every path")
      ->check(CLI::Range(2, 100000))
      ->capture_default_str();
  planner->add_flag("--json", json, "JSON on stdout");
  grouser::bench::TrajectoryBenchOptions ways;
  auto* trajectories = app.add_subcommand(
      "trajectories",
      "The steps of candidate trajectories asked of a server by Solve, by Energy and as "
      "trajectories, interleaved: bytes and time");
  grouser::bench::AddOptions(trajectories, &ways, &json);
  grouser::bench::OverloadOptions load;
  auto* overload = app.add_subcommand(
      "overload",
      "A server of its own on one core, calls from another: closed loop, 0.8 and 2 times its rate, "
      "then silence. Exits with 3 where a target is missed");
  overload->add_option("--program", load.program, "grouser-server; default: beside this program");
  overload->add_option("--server-option", load.server_options, "One more word for it; repeatable")
      ->allow_extra_args(false);
  overload->add_option("--connections", load.connections, "Clients")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  overload->add_option("--states", load.states, "Of every message")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  overload
      ->add_option("--in-flight", load.in_flight,
                   "Most calls under way on a connection, where the server allows so many")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  overload->add_option("--seconds", load.seconds, "Of each load [s]")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  overload->add_option("--settle-s", load.settle_s, "Of silence at the end [s]")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  overload->add_option("--deadline-ms", load.deadline_ms, "Of every call [ms]")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  overload->add_option("--server-core", load.server_core, "-1: any")->capture_default_str();
  overload->add_option("--client-core", load.client_core, "-1: any")->capture_default_str();
  overload->add_flag("--heed-hints", load.heeds_hints,
                     "A client that was refused waits as long as it was told");
  overload->add_option("--seed", load.seed, "Of states and arrivals")->capture_default_str();
  overload->add_flag("--json", json, "JSON on stdout");
  grouser::records::RefuseNaN(app);
  grouser::records::DescribeOnDemand(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  try {
    if (surrogate->parsed()) {
      const auto rows = grouser::bench::MeasureSurrogate(in_process);
      json ? PrintJson(rows) : PrintTable(rows);
      return 0;
    }
    if (planner->parsed()) {
      const auto rows = grouser::bench::MeasurePlanner(plans);
      json ? PrintJson(rows) : PrintTable(rows);
      return 0;
    }
    if (trajectories->parsed()) {
      const auto rows = grouser::bench::MeasureTrajectories(ways);
      json ? grouser::bench::PrintJson(rows) : grouser::bench::PrintTable(rows);
      return 0;
    }
    if (overload->parsed()) {
      const auto result = grouser::bench::MeasureOverload(load);
      json ? PrintJson(result) : PrintTable(result);
      const auto missed = result.Missed();
      for (const std::string& target : missed) std::cerr << "missed: " << target << "\n";
      return missed.empty() ? 0 : 3;
    }
    if (echo->parsed()) {
      grouser::bench::RunEcho(echo_options);
      return 0;
    }
    if (with_job) {
      const auto result =
          grouser::bench::MeasureWithJob({options.program, options.seconds, options.seed});
      json ? grouser::bench::PrintJson(result) : grouser::bench::PrintTable(result);
      return 0;
    }
    options.lcm = !no_lcm;
    const auto result = grouser::bench::MeasureServer(options);
    json ? grouser::bench::PrintJson(result) : grouser::bench::PrintTable(result);
    return 0;
  } catch (const std::exception& e) {
    std::cerr << "grouser-bench: " << e.what() << "\n";
    return 1;
  }
}
