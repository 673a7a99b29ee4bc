// Whether a candidate's intervals grow.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/distributions/beta.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <numeric>

#include "surrogate/fit/error_table.h"
#include "surrogate/fit/gate_parts.h"
#include "surrogate/model_io/run_summary.h"

namespace grouser::surrogate {
namespace {

constexpr double kLevel = 0.9;      // of intervals
constexpr int kQuantilesFrom = 30;  // runs; see Calibrate

/// Half widths over the base's, by output and state; none of an output without intervals.
std::array<std::vector<double>, kOutputs> Ratios(const TabulatedModel& old_model,
                                                 const TabulatedModel& new_model,
                                                 const std::vector<ScanState>& states) {
  std::array<std::vector<double>, kOutputs> ratios;
  for (const ScanState& s : states) {
    const WheelAnswer before = At(old_model, s.v, s.load), after = At(new_model, s.v, s.load);
    for (int o = 0; o < kOutputs; ++o) {
      if (before.half_width[o] == 0 && after.half_width[o] == 0) continue;
      ratios[o].push_back(after.half_width[o] / before.half_width[o]);
    }
  }
  return ratios;
}

double MeanOf(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double MedianOf(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Outputs of which the base's intervals cover fewer of the known runs than honest ones would.
std::array<bool, kOutputs> TooNarrow(const Known& known, const TabulatedModel& old_model) {
  std::array<bool, kOutputs> too_narrow{};
  for (const v1alpha1::ErrorRow& row : ErrorTable(CompareRows(old_model, known.rows), "known")) {
    if (row.region() != v1alpha1::REGION_ALL) continue;
    const auto* o = std::ranges::find(kOutputFields, row.output(), &OutputField::name);
    too_narrow[o - kOutputFields] = CoveredOf(row) < LeastHonest(row);
  }
  return too_narrow;
}

}  // namespace

double WidthByChance(int runs) {
  const double n = std::max(runs, kQuantilesFrom);
  const double rank = kLevel * (n + 1);
  const double covers =
      boost::math::quantile(boost::math::beta_distribution<double>(rank, n + 1 - rank), 0.975);
  const boost::math::normal_distribution<double> normal;
  return boost::math::quantile(normal, (1 + covers) / 2) /
         boost::math::quantile(normal, (1 + kLevel) / 2);
}

GateResult IntervalWidth(const v1alpha1::Model& base, const Known& known,
                         const TabulatedModel& old_model, const TabulatedModel& new_model,
                         const GateLimits& limits) {
  const auto runs = static_cast<int>(SamplesOf(base, v1alpha1::RUN_ROLE_TRAIN).size());
  const double limit = limits.width_factor > 0 ? limits.width_factor : WidthByChance(runs);
  std::vector<ScanState> at_runs;
  for (const Sample& row : known.rows) at_runs.push_back({row.motion, row.load_n});
  const auto over_domain = Ratios(old_model, new_model, Drawn(base.domain()));
  const auto over_runs = Ratios(old_model, new_model, at_runs);
  const std::array<bool, kOutputs> too_narrow = TooNarrow(known, old_model);
  double worst = 0;
  std::string outputs;
  for (const Output o : kPredicted) {
    if (over_domain[o].empty()) continue;
    const double mean = MeanOf(over_domain[o]);
    outputs += fmt::format("; {} {:.4g} (median {:.4g})", kOutputFields[o].name, mean,
                           MedianOf(over_domain[o]));
    double most = mean;
    if (!over_runs[o].empty()) {
      const double at_known = MeanOf(over_runs[o]);
      outputs += fmt::format(", {:.4g} at the runs", at_known);
      most = std::isnan(at_known) || at_known > most ? at_known : most;
    }
    if (too_narrow[o]) {
      outputs += ", not judged, as the base's cover too few";
      continue;
    }
    worst = std::isnan(most) || most > worst ? most : worst;
    if (std::isnan(worst)) break;
  }
  return Judged("interval_width", worst, Side::kAtMost, limit,
                fmt::format("times the base's 90 % half width, mean over the domain or over {} {}, "
                            "the larger, of the worst output; {}{}",
                            known.rows.size(), known.what,
                            limits.width_factor > 0
                                ? "limit as set"
                                : fmt::format("by chance {} training runs leave that much", runs),
                            outputs));
}

}  // namespace grouser::surrogate
