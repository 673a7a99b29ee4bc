#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "surrogate/accuracy_benchmark/benchmark.h"
#include "surrogate/accuracy_benchmark/targets.h"
#include "surrogate/fit/json.h"
#include "surrogate/models/form_error.h"

namespace grouser::surrogate {
namespace {

std::string Time(double ns) {
  if (std::isnan(ns)) return "-";
  if (ns < 1e3) return fmt::format("{:.0f} ns", ns);
  if (ns < 1e6) return fmt::format("{:.1f} us", ns * 1e-3);
  if (ns < 1e9) return fmt::format("{:.1f} ms", ns * 1e-6);
  return fmt::format("{:.0f} s", ns * 1e-9);
}

std::string Number(double x, const char* form) {
  return std::isnan(x) ? "-" : fmt::format(fmt::runtime(form), x);
}

/// Units in which people read an output: lengths in mm.
struct Unit {
  std::string name;
  double factor;
};
Unit UnitOf(const std::string& output) {
  const std::string si = std::ranges::find(kOutputFields, output, &OutputField::name)->unit;
  return si == "m" ? Unit{"mm", 1e3} : Unit{si, 1};
}

void MarkdownRows(const std::vector<BenchmarkRow>& rows, const std::string& pair,
                  const std::string& reference,
                  const std::function<bool(const BenchmarkRow&)>& take, std::string* out) {
  *out +=
      "| kind | time | region | output | n | rmse | p95 / load | R2 | rmse / noise | in 90 % | "
      "width / sd |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  for (const BenchmarkRow& r : rows) {
    if (r.pair != pair || r.reference != reference || !take(r)) continue;
    const Unit unit = UnitOf(r.output);
    *out += fmt::format(
        "| {} | {} | {} | {} | {} | {:.3g} {} | {:.1f} % | {} | {} | {} | {} |\n", r.kind,
        Time(r.ns_per_answer), r.region, r.output, r.n, r.rmse * unit.factor, unit.name,
        100 * r.p95_over_load, Number(r.r2, "{:.3f}"), Number(r.noise_ratio, "{:.2f}"),
        std::isnan(r.coverage90)
            ? std::string("-")
            : fmt::format("{:.0f} %{}", 100 * r.coverage90, r.covered ? "" : " (outside the band)"),
        Number(r.width_sd, "{:.1f}"));
  }
}

const BenchmarkRow* Find(const std::vector<BenchmarkRow>& rows, const BenchmarkRow& like,
                         const std::string& reference, const std::string& region) {
  const auto found = std::ranges::find_if(rows, [&](const BenchmarkRow& r) {
    return r.pair == like.pair && r.kind == like.kind && r.output == like.output &&
           r.reference == reference && r.region == region;
  });
  return found == rows.end() ? nullptr : &*found;
}

std::string Rms(const BenchmarkRow* row) {
  if (row == nullptr) return "-";
  const Unit unit = UnitOf(row->output);
  return fmt::format("{:.3g} {} ({})", row->rmse * unit.factor, unit.name, row->n);
}

// Error against time, kind by kind: against DEM, and against the measured wheel by region.
std::string SummaryRows(const std::vector<BenchmarkRow>& rows, const std::string& pair) {
  std::string head = "| kind | time | output | DEM, test states |",
              line = "| --- | --- | --- | --- |";
  for (const MeasuredGroup& group : kMeasuredGroups) {
    head += fmt::format(" measured, {} |", group.name);
    line += " --- |";
  }
  std::string out = head + "\n" + line + "\n";
  for (const BenchmarkRow& r : rows) {
    if (r.pair != pair || r.region != "all" || r.output == "m_z") continue;
    const bool measured = r.reference == "measured";
    if (measured && Find(rows, r, "dem", "all") != nullptr) continue;  // stands there already
    out += fmt::format("| {} | {} | {} | {} |", r.kind, Time(r.ns_per_answer), r.output,
                       Rms(Find(rows, r, "dem", "all")));
    for (const MeasuredGroup& group : kMeasuredGroups) {
      out += fmt::format(" {} |", Rms(Find(rows, r, "measured", group.name)));
    }
    out += "\n";
  }
  return out;
}

}  // namespace

std::string BenchmarkJson(const std::vector<BenchmarkRow>& rows) {
  Json out = Json::array();
  for (const BenchmarkRow& r : rows) {
    out.push_back({{"pair", r.pair},
                   {"kind", r.kind},
                   {"reference", r.reference},
                   {"ns_per_answer", r.ns_per_answer},
                   {"output", r.output},
                   {"region", r.region},
                   {"n", r.n},
                   {"rmse", r.rmse},
                   {"p95_over_load", r.p95_over_load},
                   {"r2", r.r2},
                   {"noise_ratio", r.noise_ratio},
                   {"coverage90", r.coverage90},
                   {"covered", r.covered},
                   {"width_sd", r.width_sd}});
  }
  return Text(out);
}

std::string BenchmarkText(const std::vector<BenchmarkRow>& rows) {
  std::string out = fmt::format(
      "{:<24} {:<14} {:>9} {:<9} {:<23} {:<8} {:>3} {:>9} {:>7} {:>7} {:>6} "
      "{:>6} {:>6}\n",
      "pair", "kind", "time", "against", "region", "output", "n", "rmse", "p95 %", "R2", "/noise",
      "in90 %", "w/sd");
  for (const BenchmarkRow& r : rows) {
    out += fmt::format(
        "{:<24} {:<14} {:>9} {:<9} {:<23} {:<8} {:>3} {:>9.3g} {:>7.1f} {:>7} {:>6} {:>5}{} "
        "{:>6}\n",
        r.pair, r.kind, Time(r.ns_per_answer), r.reference, r.region, r.output, r.n, r.rmse,
        100 * r.p95_over_load, Number(r.r2, "{:.3f}"), Number(r.noise_ratio, "{:.2f}"),
        Number(100 * r.coverage90, "{:.0f}"), std::isnan(r.coverage90) || r.covered ? ' ' : '!',
        Number(r.width_sd, "{:.1f}"));
  }
  return out + "! outside the exact 95 % binomial band of a 90 % interval; rmse in N, N m, m\n";
}

std::string BenchmarkMarkdown(const std::vector<BenchmarkRow>& rows,
                              const std::vector<Target>& targets) {
  std::vector<std::string> pairs;
  for (const BenchmarkRow& r : rows) {
    if (pairs.empty() || pairs.back() != r.pair) pairs.push_back(r.pair);
  }
  std::string out;
  for (const std::string& pair : pairs) {
    std::vector<Target> own;
    for (const Target& t : targets) {
      if (t.pair == pair) own.push_back(t);
    }
    const bool measured = std::any_of(rows.begin(), rows.end(), [&](const BenchmarkRow& r) {
      return r.pair == pair && r.reference == "measured";
    });
    if (measured) {
      out += "### " + pair + ": rms error against time (states)\n" + SummaryRows(rows, pair) + "\n";
    }
    out += "### " + pair + ": targets of the default kind and of speed\n" + TargetsMarkdown(own);
    out += "\n### " + pair + ": all test states, against full DEM\n";
    MarkdownRows(
        rows, pair, "dem", [](const BenchmarkRow& r) { return r.region == "all"; }, &out);
    out += "\n### " + pair + ": the default kind, by region\n";
    MarkdownRows(
        rows, pair, "dem",
        [](const BenchmarkRow& r) { return r.kind == "hybrid" && r.region != "all"; }, &out);
    if (!measured) continue;
    out += "\n### " + pair + ": the default kind, against the measured wheel\n";
    MarkdownRows(
        rows, pair, "measured", [](const BenchmarkRow& r) { return r.kind == "hybrid"; }, &out);
    out += "\n";
  }
  return out;
}

}  // namespace grouser::surrogate
