#include "surrogate/models/hybrid.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "surrogate/models/spline.h"

namespace grouser::surrogate {
namespace {

constexpr double kLighter = 4, kHeavier = 3;  // reach of the load axis beyond the hull

// The canonical state at a place of the chart, exact at its ends.
Canonical FromChart(const ChartPoint& at) {
  constexpr double kEnd = 1e-12;
  const bool pole = at.lateral_rad > std::numbers::pi / 2 - kEnd;
  const bool across = std::fabs(at.direction_rad) > std::numbers::pi / 2 - kEnd;
  const double plane = pole ? 0 : std::cos(at.lateral_rad);
  const double v_x = across ? 0 : plane * std::cos(at.direction_rad);
  // +pi/2 and -pi/2 are one state and its mirror; the table's node is -pi/2.
  return ToCanonical(v_x, std::sin(at.lateral_rad), plane * std::sin(at.direction_rad));
}

using Channels = std::array<std::vector<double>, ResidualTable::kChannels>;

void Append(const std::array<double, ResidualTable::kChannels>& node, Channels* channels) {
  for (int c = 0; c < ResidualTable::kChannels; ++c) (*channels)[c].push_back(node[c]);
}

std::array<std::span<const double>, ResidualTable::kChannels> Spans(const Channels& channels) {
  std::array<std::span<const double>, ResidualTable::kChannels> spans;
  for (int c = 0; c < ResidualTable::kChannels; ++c) spans[c] = channels[c];
  return spans;
}

// Values at nodes to coefficients.
void InterpolateChannels(const TableAxes& axes, Channels* channels) {
  for (int c = 0; c < ResidualTable::kChannels; ++c) {
    // Across the pole a state meets its mirror in x.
    const ResidualTable::Parity parity = ResidualTable::ParityOf(c);
    const SplineEnds ends{parity.x > 0 ? SplineEnd::kEven : SplineEnd::kOdd, SplineEnd::kFree};
    (*channels)[c] = InterpolateTable(axes, parity, (*channels)[c], ends);
  }
}

// Knots of `fine` contain those of the residual's axis of `coarse` intervals.
int Multiple(int coarse, int at_least) { return coarse * ((at_least + coarse - 1) / coarse); }

}  // namespace

HybridModel::HybridModel(const BekkerModel& physics, ResidualTable table, const HullBox& hull,
                         const Uncertainty& uncertainty)
    : TabulatedModel(Hull(hull, uncertainty), physics.wheel().radius_m),
      physics_(physics),
      table_(std::move(table)) {}

HybridModel::HybridModel(const BekkerModel& physics, ResidualTable table, ResidualTable rate,
                         const SpeedAxis& speed, const HullBox& hull,
                         const Uncertainty& uncertainty)
    : HybridModel(physics, std::move(table), hull, uncertainty) {
  CheckSpeedAxis(speed, table_.axes(), rate.axes());
  rate_ = std::move(rate);
  speed_ = speed;
}

std::array<double, ResidualTable::kChannels> HybridModel::Residual(const Canonical& state,
                                                                   double log_load) const noexcept {
  const ChartPoint chart = ToChart(state);
  auto channels = table_.Evaluate(chart, log_load);
  if (!speed_.present()) return channels;
  const double u = speed_.At(domain().Froude(state.speed, physics_.wheel().radius_m));
  const auto rate = rate_.Evaluate(chart, log_load);
  for (int c = 0; c < ResidualTable::kChannels; ++c) channels[c] += u * rate[c];
  return channels;
}

HybridModel::Answer HybridModel::EvaluateOne(double v_x, double v_y, double rim_speed,
                                             double load) const noexcept {
  Answer answer{};
  answer.flags = domain().uncertainty().form_unknown ? kFormUnknown : 0u;
  if (v_x == 0 && v_y == 0 && rim_speed == 0) {
    const BekkerModel::Answer still = physics_.SolveStatic(load);
    answer.value = still.value;
    answer.flags |= kStatic | kExtrapolated;
    if (still.no_equilibrium) answer.flags |= kNoEquilibrium | kClamped;
    domain().AddUncertainty(1, 0, load, &answer);
    return answer;
  }
  const Canonical state = ToCanonical(v_x, v_y, rim_speed);
  const BekkerModel::Answer trend = physics_.SolveCanonical(state, load);
  const double radius = physics_.wheel().radius_m, log_load = std::log(load);
  const auto rest = Residual(state, log_load);
  answer.value = trend.value;
  for (int o = 0; o < kOutputs; ++o) answer.value[o] += OutputScale(o, load, radius) * rest[o];
  if (answer.value[kSinkage] < 0) {
    answer.value[kSinkage] = 0;
    answer.flags |= kClamped;
  }
  ApplyMirrors(state, &answer.value);

  if (trend.no_equilibrium) answer.flags |= kNoEquilibrium | kClamped;
  if (state.speed > domain().Fastest(radius)) answer.flags |= kRate;
  double distance = rest[ResidualTable::kDistance] > 0 ? rest[ResidualTable::kDistance] : 0;
  distance += domain().Excess(state, load, radius);
  if (domain().Outside(state, load) || distance > Hull::kFarFromRuns ||
      answer.value[kSinkage] > Hull::kOverloadSinkage * radius) {
    answer.flags |= kExtrapolated;
  }
  domain().AddUncertainty(distance, Hull::Ploughing(state), load, &answer);
  return answer;
}

std::array<double, ResidualTable::kChannels> HybridModel::AtNode(const ChartPoint& chart,
                                                                 double log_load) const noexcept {
  const double radius = physics_.wheel().radius_m;
  const Canonical state = FromChart(chart);
  const double load = std::exp(log_load);
  BekkerModel::Answer trend = physics_.SolveCanonical(state, load);
  trend.value[kFz] = load;            // where the soil carries less: Limit, in the kernel
  ApplyMirrors(state, &trend.value);  // the node at direction -pi/2 is a mirror
  if (chart.lateral_rad == 0) trend.value[kFy] = trend.value[kMz] = 0;
  auto channels = table_.Evaluate(chart, log_load);
  for (int o = 0; o < kOutputs; ++o) {
    channels[o] += trend.value[o] / OutputScale(o, load, radius);
  }
  return channels;
}

void HybridModel::Tabulate(const Resolution& wanted) {
  Resolution resolution = wanted;
  double step = wanted.log_load, anchor = std::log(hull().load_min_n);
  if (!table_.empty()) {
    const TableAxes& coarse = table_.axes();
    resolution.direction = Multiple(coarse.direction, wanted.direction);
    resolution.lateral = Multiple(coarse.lateral, wanted.lateral);
    const double width = (coarse.log_load_max - coarse.log_load_min) / coarse.load;
    step = width / std::ceil(width / wanted.log_load);
    anchor = coarse.log_load_min;
  }
  const double low = std::log(hull().load_min_n / kLighter);
  const double high = std::log(hull().load_max_n * kHeavier);
  const int before = static_cast<int>(std::ceil((anchor - low) / step));
  const int after = static_cast<int>(std::floor((high - anchor) / step));
  const TableAxes axes{resolution.direction, resolution.lateral, before + after,
                       anchor - before * step, anchor + after * step};

  Channels values, rate;
  std::vector<double> margin;
  for (const TableNode& node : TableNodes(axes)) {
    const double most =
        physics_.AtSinkage(FromChart(node.chart), physics_.max_sinkage()).value[kFz];
    margin.push_back(std::clamp(std::log(std::max(most, 1e-30)) - node.log_load, -8.0, 8.0));
    Append(AtNode(node.chart, node.log_load), &values);
    if (speed_.present()) Append(rate_.Evaluate(node.chart, node.log_load), &rate);
  }
  InterpolateChannels(axes, &values);
  const SplineEnds even{SplineEnd::kEven, SplineEnd::kFree};
  margin = InterpolateTable(axes, {1, 1}, margin, even);
  ResponseTable table(axes, Spans(values), margin);
  if (speed_.present()) {
    InterpolateChannels(axes, &rate);
    rate[ResidualTable::kDistance].clear();
    table.AddSpeed(speed_, Spans(rate));
  }
  SetTable(std::move(table), /*blended=*/true);
}

}  // namespace grouser::surrogate
