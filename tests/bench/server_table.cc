#include "tests/bench/server_table.h"

#include <fmt/format.h>

namespace grouser::bench {
namespace {

const char* Judged(bool met) { return met ? "met" : "missed"; }

std::string Text(const LatencyRatio& r) {
  const std::string target =
      r.target > 0 ? fmt::format("{:.2f} {:6}", r.target, Judged(r.met())) : "";
  return fmt::format("{:>9.1f} {:>9.1f}  {:.2f} ({:.2f} to {:.2f}) {:11}", r.server_us, r.echo_us,
                     r.ratio, r.least, r.most, target);
}

std::string Json(const LatencyRatio& r) {
  return fmt::format(
      "{{\"server_us\": {:.3f}, \"echo_us\": {:.3f}, \"ratio\": {:.4f}, \"least\": {:.4f}, "
      "\"most\": {:.4f}, \"target\": {:.3f}, \"met\": {}}}",
      r.server_us, r.echo_us, r.ratio, r.least, r.most, r.target, r.met());
}

}  // namespace

void PrintTable(const ServerResult& result) {
  fmt::print("{:11} {:>6} {:>8} {:>8} {:>7} {:>4}  {:46}  {}\n", "transport", "states", "answered",
             "bytes", "samples", "lost",
             result.query_log ? "p50 us: with a log, without, ratio (fifths)"
                              : "p50 us: server, echo, ratio (fifths), target",
             "p99 us: likewise");
  for (const auto& row : result.rows) {
    fmt::print("{:11} {:>6} {:>8} {:>8} {:>7} {:>4}  {}  {}\n", row.transport, row.states,
               row.fields, row.answer_bytes, row.samples, row.lost, Text(row.p50), Text(row.p99));
  }
  if (result.query_log) return;
  const FirstMessage& f = result.first;
  fmt::print(
      "first message of 10,000 states: {:.0f} us ({:.0f} in the server), {:.2f} ({:.2f} to {:.2f}) "
      "times the median, target {:.2f}: {}; the echo's: {:.0f} us, {:.2f}\n",
      f.server_us, f.in_server_us, f.ratio, f.least, f.most, f.target, Judged(f.met()), f.echo_us,
      f.echo_ratio);
}

void PrintJson(const ServerResult& result) {
  fmt::print("{{\"query_log\": {}, \"rows\": [", result.query_log);
  const char* separator = "\n";
  for (const auto& row : result.rows) {
    fmt::print(
        "{}  {{\"transport\": \"{}\", \"states\": {}, \"fields\": \"{}\", \"answer_bytes\": {}, "
        "\"samples\": {}, \"lost\": {}, \"p50\": {}, \"p99\": {}}}",
        separator, row.transport, row.states, row.fields, row.answer_bytes, row.samples, row.lost,
        Json(row.p50), Json(row.p99));
    separator = ",\n";
  }
  if (result.query_log) {
    fmt::print("\n]}}\n");
    return;
  }
  const FirstMessage& f = result.first;
  fmt::print(
      "\n], \"first_message\": {{\"server_us\": {:.1f}, \"in_server_us\": {:.1f}, \"echo_us\": "
      "{:.1f}, \"ratio\": {:.3f}, \"least\": {:.3f}, \"most\": {:.3f}, \"echo_ratio\": {:.3f}, "
      "\"target\": {:.2f}, \"met\": {}}}}}\n",
      f.server_us, f.in_server_us, f.echo_us, f.ratio, f.least, f.most, f.echo_ratio, f.target,
      f.met());
}

void PrintTable(const JobResult& result) {
  fmt::print("1 kHz stream of {} states beside {}\n{:44} {:>7} {:>9} {:>9} {:>9} {:>9} {:>7}\n",
             result.states, result.job, "means", "samples", "over 1 ms", "echo's", "p99 us",
             "echo's", "target");
  for (const auto& row : result.rows) {
    fmt::print(
        "{:44} {:>7} {:>7.2f} % {:>7.2f} % {:>9.0f} {:>9.0f} {}\n", row.means, row.samples,
        100 * row.share, 100 * row.echo_share, row.p99_us, row.echo_p99_us,
        row.target < 0 ? "" : fmt::format("{:.2f} % {}", 100 * row.target, Judged(row.met())));
  }
}

void PrintJson(const JobResult& result) {
  fmt::print("{{\"job\": \"{}\", \"states\": {}, \"rows\": [", result.job, result.states);
  const char* separator = "\n";
  for (const auto& row : result.rows) {
    fmt::print(
        "{}  {{\"means\": \"{}\", \"samples\": {}, \"share_over_1_ms\": {:.5f}, "
        "\"echo_share_over_1_ms\": {:.5f}, \"p99_us\": {:.1f}, \"echo_p99_us\": {:.1f}",
        separator, row.means, row.samples, row.share, row.echo_share, row.p99_us, row.echo_p99_us);
    if (row.target >= 0) {
      fmt::print(", \"target\": {:.5f}, \"met\": {}", row.target, row.met());
    }
    fmt::print("}}");
    separator = ",\n";
  }
  fmt::print("\n]}}\n");
}

}  // namespace grouser::bench
