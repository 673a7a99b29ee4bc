#include "surrogate/accuracy_benchmark/targets.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "surrogate/accuracy_benchmark/benchmark.h"
#include "surrogate/model_io/upgrade.h"

namespace grouser::surrogate {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kDefault = "hybrid";

class Collector {
 public:
  Collector(const std::vector<BenchmarkRow>& rows, std::string pair)
      : rows_(rows), pair_(std::move(pair)) {}

  const BenchmarkRow* Find(const char* kind, const std::string& region,
                           const std::string& output) const {
    for (const BenchmarkRow& r : rows_) {
      if (r.pair == pair_ && r.reference == "dem" && r.kind == kind && r.region == region &&
          r.output == output) {
        return &r;
      }
    }
    return nullptr;
  }
  void Add(std::string what, double value, double target, double moonshot, bool at_least) {
    if (!std::isnan(value)) {
      found_.push_back({pair_, std::move(what), value, target, moonshot, at_least});
    }
  }
  std::vector<Target> Take() { return std::move(found_); }

 private:
  const std::vector<BenchmarkRow>& rows_;
  std::string pair_;
  std::vector<Target> found_;
};

void AddErrors(Collector* c) {
  for (const Output o : kPredicted) {
    const char* output = kOutputFields[o].name;
    const BenchmarkRow* r = c->Find(kDefault, "all", output);
    if (!r) continue;
    c->Add(fmt::format("{}: rmse over patch noise", output), r->noise_ratio, 2, 1.2, false);
  }
  const struct {
    const char* output;
    double all;
  } fits[] = {{"f_x", 0.97}, {"f_y", 0.97}, {"torque", 0.95}, {"sinkage", 0.95}};
  for (const auto& f : fits) {
    const BenchmarkRow* r = c->Find(kDefault, "all", f.output);
    if (r) c->Add(fmt::format("{}: R2, all {} states", f.output, r->n), r->r2, f.all, 0.99, true);
  }
  for (const auto& f : fits) {
    const BenchmarkRow* r = c->Find(kDefault, "core", f.output);
    if (!r) continue;
    c->Add(fmt::format("{}: R2, core ({} states)", f.output, r->n), r->r2, 0.9, 0.95, true);
  }
  for (const char* region : {"braking", "towed", "driving", "lateral"}) {
    for (const char* output : {"f_x", "f_y", "torque", "m_z"}) {
      const BenchmarkRow* r = c->Find(kDefault, region, output);
      if (!r) continue;
      c->Add(fmt::format("{}: p95 over load, {} ({} states)", output, region, r->n),
             r->p95_over_load, 0.1, 0.05, false);
    }
  }
}

void AddIntervals(const CrossConformal& cross, Collector* c) {
  for (const Output o : kPredicted) {
    const char* output = kOutputFields[o].name;
    const BenchmarkRow* r = c->Find(kDefault, "all", output);
    if (!r || std::isnan(r->coverage90)) continue;
    c->Add(fmt::format("{}: test coverage {:.0f} % in the band", output, 100 * r->coverage90),
           r->covered ? 1 : 0, 1, kNone, true);
    const auto found = cross.share.find(output);
    if (found != cross.share.end()) {
      const double all = (found->second * cross.n + r->coverage90 * r->n) / (cross.n + r->n);
      c->Add(fmt::format("{}: cross-conformal and test coverage off 90 %, {} runs", output,
                         cross.n + r->n),
             std::fabs(all - 0.9), 0.03, kNone, false);
    }
    c->Add(fmt::format("{}: interval width over sd of the errors", output), r->width_sd, 4, kNone,
           false);
  }
}

void AddTimes(Collector* c) {
  const struct {
    const char* kind;
    double target, moonshot;
  } times[] = {{"bekker", 1000, 300}, {"lookup", 50, 15}, {"hybrid", 50, 15}};
  for (const auto& t : times) {
    const BenchmarkRow* r = c->Find(t.kind, "all", "f_x");
    if (r)
      c->Add(fmt::format("{}: ns a state", t.kind), r->ns_per_answer, t.target, t.moonshot, false);
  }
}

const char* Verdict(const Target& t) {
  if (!t.Met()) return "MISSED";
  return t.Moonshot() ? "moonshot" : "met";
}

std::string Limit(double x) { return std::isnan(x) ? "-" : fmt::format("{:.4g}", x); }

}  // namespace

std::vector<Target> TargetsOf(const std::vector<BenchmarkRow>& rows, const std::string& pair,
                              const CrossConformal& hybrid) {
  Collector collector(rows, pair);
  AddErrors(&collector);
  AddIntervals(hybrid, &collector);
  AddTimes(&collector);
  return collector.Take();
}

std::vector<Target> TargetsOf(const std::vector<BenchmarkRow>& rows, const PairFolder& pair) {
  CrossConformal cross;
  const v1alpha1::Model hybrid = ReadModel(pair.path + "/hybrid.model").model;
  for (const v1alpha1::ErrorRow& row : hybrid.errors()) {
    if (row.set() != "cross_conformal") continue;
    cross.share[row.output()] = row.covered90();
    cross.n = static_cast<int>(row.n());
  }
  return TargetsOf(rows, pair.name, cross);
}

std::string TargetsText(const std::vector<Target>& targets) {
  std::string out;
  for (const Target& t : targets) {
    out += fmt::format("{:<24} {:<52} {:>8.3g} {} {:<6} (moonshot {:<5}) {}\n", t.pair, t.what,
                       t.value, t.at_least ? ">=" : "<=", Limit(t.target), Limit(t.moonshot),
                       Verdict(t));
  }
  return out;
}

std::string TargetsMarkdown(const std::vector<Target>& targets) {
  std::string out = "| what | measured | target | moonshot | |\n| --- | --- | --- | --- | --- |\n";
  for (const Target& t : targets) {
    out += fmt::format("| {} | {:.3g} | {} {} | {} | {} |\n", t.what, t.value,
                       t.at_least ? "at least" : "at most", Limit(t.target), Limit(t.moonshot),
                       Verdict(t));
  }
  return out;
}

}  // namespace grouser::surrogate
