#include "surrogate/accuracy_benchmark/errors.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>
#include <tuple>

#include "surrogate/fit/binomial_band.h"
#include "surrogate/fit/error_table.h"
#include "surrogate/fit/training_set.h"
#include "surrogate/models/form_error.h"

namespace grouser::surrogate {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kLevel = 0.9;

struct Region {
  const char* name;
  std::function<bool(const Compared&)> has;
};

MeasuredRegion MeasuredRegionOf(const Compared& j) {
  const VelocityState v = FromSlip(j.slip, j.attack_angle_rad, 1);
  return MeasuredRegionAt(v.v_x, v.v_y, v.rim_speed);
}

std::vector<Region> MeasuredRegions() {
  std::vector<Region> regions = {{"all", [](const Compared&) { return true; }}};
  for (const MeasuredGroup& group : kMeasuredGroups) {
    regions.push_back({group.name, [group](const Compared& j) {
                         return group.has[static_cast<std::size_t>(MeasuredRegionOf(j))];
                       }});
  }
  return regions;
}

std::vector<Region> Regions() {
  std::vector<Region> regions;
  for (const v1alpha1::Region region : kRegions) {
    regions.push_back({RegionName(region), [region](const Compared& j) {
                         return IsIn(region, j.slip, j.attack_angle_rad);
                       }});
  }
  regions.push_back({"core", [](const Compared& j) {
                       const double most = 30 * std::numbers::pi / 180 + 1e-9;
                       return j.slip >= 0.1 && j.slip <= 0.9 &&
                              std::fabs(j.attack_angle_rad) <= most;
                     }});
  return regions;
}

/// By linear interpolation between order statistics.
double Percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const double at = share * static_cast<double>(values.size() - 1);
  const auto low = static_cast<std::size_t>(at);
  const std::size_t high = std::min(low + 1, values.size() - 1);
  return values[low] + (at - static_cast<double>(low)) * (values[high] - values[low]);
}

/// Repeats of one state are one.
std::size_t CountStates(const std::vector<const Compared*>& compared) {
  std::set<std::tuple<double, double, double>> states;
  for (const Compared* j : compared) states.insert({j->slip, j->attack_angle_rad, j->load_n});
  return states.size();
}

BenchmarkRow MeasureOutput(const BenchmarkRow& head, const std::vector<const Compared*>& states,
                           int o, double noise, double radius_m) {
  BenchmarkRow row = head;
  row.output = kOutputFields[o].name;
  row.n = static_cast<int>(states.size());
  const double n = row.n;
  double mean = 0, bias = 0;
  for (const Compared* j : states) {
    mean += j->truth[o] / n;
    bias += (j->value[o] - j->truth[o]) / n;
  }
  double error2 = 0, about2 = 0, noise2 = 0, width = 0, spread2 = 0;
  int inside = 0, intervals = 0;
  std::vector<double> relative;
  for (const Compared* j : states) {
    const double error = j->value[o] - j->truth[o];
    const double scale = OutputScale(o, j->load_n, radius_m);
    error2 += error * error / n;
    spread2 += (error - bias) * (error - bias) / n;
    about2 += (j->truth[o] - mean) * (j->truth[o] - mean) / n;
    noise2 += noise * noise * scale * scale / n;
    relative.push_back(std::fabs(error) / scale);
    width += 2 * j->half_width[o] / n;
    intervals += j->half_width[o] > 0 ? 1 : 0;
    inside += Covered(j->truth[o], j->value[o], j->half_width[o]) ? 1 : 0;
  }
  row.rmse = std::sqrt(error2);
  row.p95_over_load = Percentile(relative, 0.95);
  row.r2 = CountStates(states) >= 3 && about2 > 0 ? 1 - error2 / about2 : kNaN;
  row.noise_ratio = noise2 > 0 ? row.rmse / std::sqrt(noise2) : kNaN;
  row.coverage90 = row.width_sd = kNaN;
  if (intervals < row.n) return row;
  const Band band = BinomialBand(row.n, kLevel);
  row.coverage90 = inside / n;
  row.covered = band.Has(inside);
  if (spread2 > 0) row.width_sd = width / std::sqrt(spread2);
  return row;
}

}  // namespace

std::vector<BenchmarkRow> MeasureErrors(const BenchmarkRow& head,
                                        const std::vector<Compared>& answers,
                                        const std::array<double, kOutputs>& noise,
                                        double radius_m) {
  std::vector<BenchmarkRow> rows;
  for (const Region& region : head.reference == "measured" ? MeasuredRegions() : Regions()) {
    for (const Output o : kPredicted) {
      std::vector<const Compared*> here;
      for (const Compared& j : answers) {
        if (region.has(j) && !std::isnan(j.truth[o])) here.push_back(&j);
      }
      if (here.empty()) continue;
      rows.push_back(MeasureOutput(head, here, o, noise[o], radius_m));
      rows.back().region = region.name;
    }
  }
  return rows;
}

}  // namespace grouser::surrogate
