// grouser-bench: measurements of a running system.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/bench/latency_bench.h"

namespace {

constexpr const char* kExamples =
    "Examples:\n"
    "  grouser-bench latency --server 127.0.0.1:50151\n"
    "  grouser-bench latency --no-lcm --seconds 5 --json\n"
    "Exit codes: 0 ok, 1 failed, 2 usage.";

void PrintTable(const std::vector<grouser::bench::LatencyRow>& rows) {
  fmt::print("{:12} {:>7} {:>8} {:>6} {:>10} {:>10} {:>12}\n", "transport", "batch", "samples",
             "lost", "p50 us", "p99 us", "states/s");
  for (const auto& row : rows) {
    fmt::print("{:12} {:>7} {:>8} {:>6} {:>10.1f} {:>10.1f} {:>12.0f}\n", row.transport, row.batch,
               row.samples, row.lost, row.p50_us, row.p99_us, row.states_per_s);
  }
}

void PrintJson(const std::vector<grouser::bench::LatencyRow>& rows) {
  fmt::print("[");
  const char* separator = "\n";
  for (const auto& row : rows) {
    fmt::print("{}  {{\"transport\": \"{}\", \"batch\": {}, \"samples\": {}, \"lost\": {}, "
               "\"p50_us\": {:.3f}, \"p99_us\": {:.3f}, \"states_per_s\": {:.1f}}}",
               separator, row.transport, row.batch, row.samples, row.lost, row.p50_us, row.p99_us,
               row.states_per_s);
    separator = ",\n";
  }
  fmt::print("\n]\n");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Measures a running Grouser."};
  app.footer(kExamples);
  app.require_subcommand(1);
  grouser::bench::LatencyOptions options;
  bool json = false;
  bool no_lcm = false;
  auto* latency = app.add_subcommand(
      "latency", "Round trips of gRPC unary, gRPC stream and LCM at 1 to 10000 states, interleaved");
  latency->add_option("--server", options.server, "grouser-server HOST:PORT")
      ->capture_default_str();
  latency->add_option("--model", options.model, "Model; default: the only one");
  auto* without = latency->add_flag("--no-lcm", no_lcm, "gRPC alone");
  latency->add_option("--lcm-url", options.lcm_url, "LCM URL (default: $LCM_DEFAULT_URL)")
      ->excludes(without);
  latency->add_option("--seconds", options.seconds, "About how long to measure [s]")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  latency->add_option("--seed", options.seed, "Of the random states")->capture_default_str();
  latency->add_flag("--json", json, "JSON on stdout");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  try {
    options.lcm = !no_lcm;
    const auto rows = grouser::bench::MeasureLatency(options);
    json ? PrintJson(rows) : PrintTable(rows);
    return 0;
  } catch (const std::exception& e) {
    std::cerr << "grouser-bench: " << e.what() << "\n";
    return 1;
  }
}
