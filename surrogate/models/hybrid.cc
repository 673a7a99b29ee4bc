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
constexpr double kAmple = 8;                  // |ln(largest load/load)| from which it is all one

// ln(largest load/load) of physics that carry `most` [N] at most.
double Margin(double most, double log_load) {
  return std::clamp(std::log(std::max(most, 1e-30)) - log_load, -kAmple, kAmple);
}

// That of an answer of which physics have the share 1 - q.
double Carried(double margin, double q) {
  return (1 - q) * margin + kAmple * SmoothStep(2 * q - 1);
}

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
constexpr std::size_t kLawBlock = 64;  // states

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

// Adds the physics at the nodes to `values`, and finds ln(largest load that has an
// equilibrium/load) there.
std::vector<double> AddTrend(const BekkerModel& physics, BlockSolver solver, const TableAxes& axes,
                             Channels* values) {
  const std::vector<TableNode> nodes = TableNodes(axes);
  const std::size_t n = nodes.size();
  std::array<std::vector<double>, kInputs> input;
  std::array<std::vector<double>, kOutputs> output;
  for (const TableNode& node : nodes) {
    const Canonical state = FromChart(node.chart);
    // The node at direction -pi/2 is a mirror.
    input[kVx].push_back(state.sign_x * state.forward);
    input[kVy].push_back(state.lateral);
    input[kRimSpeed].push_back(state.sign_x * state.rim);
    input[kLoad].push_back(std::exp(node.log_load));
  }
  BekkerBatch law{input[kVx], input[kVy], input[kRimSpeed], input[kLoad], {}, {}, {}};
  for (int o = 0; o < kOutputs; ++o) {
    output[o].resize(n);
    law.value[o] = output[o];
  }
  physics.SolveBatch(law, solver);
  std::vector<double> margin(n);
  double most = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double load = input[kLoad][i];
    output[kFz][i] = load;  // where the soil carries less: Limit, in the kernel
    const double share = (*values)[ResidualTable::kShare][i];
    for (int o = 0; o < kOutputs; ++o) {
      const double of_physics = output[o][i] / OutputScale(o, load, physics.wheel().radius_m);
      (*values)[o][i] += (1 - share) * of_physics;
    }
    if (i % (axes.load + 1) == 0) {  // the loads of a motion stand side by side
      most = physics.AtSinkage(FromChart(nodes[i].chart), physics.max_sinkage()).value[kFz];
    }
    margin[i] = Carried(Margin(most, nodes[i].log_load), share);
  }
  return margin;
}

// Knots of `fine` contain those of the residual's axis of `coarse` intervals.
int Multiple(int coarse, int at_least) { return coarse * ((at_least + coarse - 1) / coarse); }

}  // namespace

HybridModel::HybridModel(const BekkerModel& physics, ResidualTable table,
                         const TrainingDomain& hull, const Uncertainty& uncertainty)
    : TabulatedModel(Hull(hull, uncertainty), physics.wheel().radius_m),
      physics_(physics),
      table_(std::move(table)) {}

HybridModel::HybridModel(const BekkerModel& physics, ResidualTable table, ResidualTable rate,
                         const SpeedAxis& speed, const TrainingDomain& hull,
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
  return Complete(physics_.Solve(v_x, v_y, rim_speed, load), v_x, v_y, rim_speed, load);
}

HybridModel::Answer HybridModel::OffTable(double v_x, double v_y, double rim_speed,
                                          double load) const noexcept {
  if (by_law_) return Complete({}, v_x, v_y, rim_speed, load);  // AddLaw adds the rest
  return EvaluateOne(v_x, v_y, rim_speed, load);
}

HybridModel::Answer HybridModel::Complete(const BekkerModel::Answer& trend, double v_x, double v_y,
                                          double rim_speed, double load) const noexcept {
  Answer answer{};
  answer.flags = domain().uncertainty().Flags();
  answer.value = trend.value;
  if (v_x == 0 && v_y == 0 && rim_speed == 0) {
    if (trend.no_equilibrium) answer.flags |= kNoEquilibrium | kClamped;
    answer.flags |= kStatic | kExtrapolated;
    domain().AddUncertainty(1, 0, load, &answer);
    return answer;
  }
  const Canonical state = ToCanonical(v_x, v_y, rim_speed);
  const double radius = physics_.wheel().radius_m, log_load = std::log(load);
  const auto rest = Residual(state, log_load);
  std::array<double, kOutputs> more{};
  for (int o = 0; o < kOutputs; ++o) more[o] = OutputScale(o, load, radius) * rest[o];
  ApplyMirrors(state, &more);
  const double share = rest[ResidualTable::kShare];
  for (int o = 0; o < kOutputs; ++o) answer.value[o] = (1 - share) * trend.value[o] + more[o];
  if (trend.no_equilibrium && share == 0) answer.flags |= kNoEquilibrium | kClamped;
  if (trend.no_equilibrium && share != 0) {
    const double carried = Carried(Margin(trend.value[kFz], log_load), share);
    if (carried < 0) answer.flags |= kNoEquilibrium | kClamped;
    answer.value[kFz] = carried < 0 ? load * std::exp(carried) : load;
  }
  if (answer.value[kSinkage] < 0) {
    answer.value[kSinkage] = 0;
    answer.flags |= kClamped;
  }
  if (state.speed > domain().Fastest(radius)) answer.flags |= kRate;
  double distance = rest[ResidualTable::kDistance] > 0 ? rest[ResidualTable::kDistance] : 0;
  distance += domain().Excess(state, load, radius);
  if (domain().Outside(state, load) || distance > Hull::kFarFromRuns ||
      answer.value[kSinkage] > Hull::kOverloadSinkage * radius) {
    answer.flags |= kExtrapolated;
  }
  domain().AddUncertainty(distance, Hull::Bulldozing(state), load, &answer);
  return answer;
}

void HybridModel::Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept {
  TabulatedModel::Evaluate(in, out);
  if (!by_law_) return;
  const std::size_t n = in.load.size();
  for (std::size_t first = 0; first < n; first += kLawBlock) {
    AddLaw(in, out, first, std::min(n - first, kLawBlock));
  }
}

void HybridModel::AddLaw(const WheelStatesView& in, const ResponsesView& out, std::size_t first,
                         std::size_t n) const noexcept {
  double value[kOutputs][kLawBlock], gradient[kOutputs][kInputs][kLawBlock];
  std::uint8_t lost[kLawBlock];
  const auto some = [&](std::span<const double> all) { return all.subspan(first, n); };
  BekkerBatch law{some(in.v_x), some(in.v_y), some(in.rim_speed), some(in.load), {}, {}, {}};
  law.no_equilibrium = {lost, n};
  for (int o = 0; o < kOutputs; ++o) {
    const OutputView& to = out.output[o];
    const std::span<double> slopes[kInputs] = {to.d_v_x, to.d_v_y, to.d_rim_speed, to.d_load};
    law.value[o] = {value[o], n};
    for (int k = 0; k < kInputs; ++k) {
      if (!slopes[k].empty()) law.gradient[o][k] = {gradient[o][k], n};
    }
  }
  physics_.SolveBatch(law, solver());
  // NaN, where the law answers nothing, leaves what stands in `out`.
  const auto add = [&](std::span<double> to, std::span<const double> what) {
    if (to.empty()) return;
    for (std::size_t i = 0; i < n; ++i) to[first + i] += std::isnan(what[i]) ? 0 : what[i];
  };
  for (int o = 0; o < kOutputs; ++o) {
    const OutputView& to = out.output[o];
    add(to.value, law.value[o]);
    add(to.low, law.value[o]);
    add(to.high, law.value[o]);
    const std::span<double> slopes[kInputs] = {to.d_v_x, to.d_v_y, to.d_rim_speed, to.d_load};
    for (int k = 0; k < kInputs; ++k) add(slopes[k], law.gradient[o][k]);
  }
  const double most = Hull::kOverloadSinkage * physics_.wheel().radius_m;
  for (std::size_t i = 0; i < n; ++i) {
    std::uint32_t& flags = out.flags[first + i];
    if ((flags & kInvalid) != 0 || std::isnan(value[kSinkage][i])) continue;
    if (lost[i] != 0) flags |= kNoEquilibrium | kClamped;
    if (value[kSinkage][i] > most) flags |= kExtrapolated;
  }
}

void HybridModel::Prepare() {
  if (WantsTable()) {
    Tabulate();
  } else {
    AnswerByLaw();
  }
}

std::size_t HybridModel::TableSize() const noexcept {
  return WantsTable() ? ResponseTable::SizeOf(AxesFor({}), speed_) : 0;
}

std::string HybridModel::TableBytes() const {
  return tabulated() && !by_law_ ? table()->Bytes() : "";
}

void HybridModel::TakeTable(std::string_view bytes) {
  by_law_ = false;
  SetTable(ResponseTable(AxesFor({}), speed_, bytes), /*blended=*/true);
}

void HybridModel::AnswerByLaw() {
  by_law_ = true;
  const TableAxes axes = table_.empty() ? TableAxes{1, 1, 1, 0, 1} : table_.axes();
  Channels values;
  for (const TableNode& node : TableNodes(axes)) {
    Append(table_.Evaluate(node.chart, node.log_load), &values);
  }
  InterpolateChannels(axes, &values);
  SetTable(ResponseTable(axes, Spans(values)), /*blended=*/false);
}

TableAxes HybridModel::AxesFor(const Resolution& wanted) const noexcept {
  Resolution resolution = wanted;
  double step = wanted.log_load, anchor = std::log(hull().load_min_n);
  if (!table_.empty()) {
    const TableAxes& coarse = table_.axes();
    const bool smooth = table_.has_share();
    resolution.direction = Multiple(coarse.direction, smooth ? 1 : wanted.direction);
    resolution.lateral = Multiple(coarse.lateral, wanted.lateral);
    const double width = (coarse.log_load_max - coarse.log_load_min) / coarse.load;
    step = width / std::ceil(width / wanted.log_load);
    anchor = coarse.log_load_min;
  }
  const double low = std::log(hull().load_min_n / kLighter);
  const double high = std::log(hull().load_max_n * kHeavier);
  const int before = static_cast<int>(std::ceil((anchor - low) / step));
  const int after = static_cast<int>(std::floor((high - anchor) / step));
  return {resolution.direction, resolution.lateral, before + after, anchor - before * step,
          anchor + after * step};
}

void HybridModel::Tabulate(const Resolution& resolution) {
  const TableAxes axes = AxesFor(resolution);
  by_law_ = false;
  Channels values, rate;
  for (const TableNode& node : TableNodes(axes)) {
    Append(table_.Evaluate(node.chart, node.log_load), &values);
    if (speed_.present()) Append(rate_.Evaluate(node.chart, node.log_load), &rate);
  }
  std::vector<double> margin = AddTrend(physics_, solver(), axes, &values);
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
