#include "surrogate/models/response_table.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

namespace grouser::surrogate {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

void DescribeHull(const Hull& hull, double radius_m, response::Constants* c) {
  const TrainingDomain& box = hull.box();
  const double edge = Hull::kEdge;
  c->slip_low = box.slip_min - edge;
  c->slip_high = box.slip_max + edge;
  // angle > max + edge for an angle in [0, pi/2]; never, where all are covered.
  const double most = box.attack_angle_max_rad + edge;
  const bool all = most >= std::numbers::pi / 2;
  c->angle_sin = all ? 1 : std::sin(most);
  c->angle_cos = all ? 0 : std::cos(most);
  c->load_low = box.load_min_n * (1 - edge);
  c->load_high = box.load_max_n * (1 + edge);
  c->rim_faster = 1 - edge;
  const double fastest = hull.Fastest(radius_m);
  c->fastest2 = fastest < kNever ? fastest * fastest : kNever;
  c->inverse_fastest = 1 / fastest;
  c->most_fast = Hull::kMostSpeedExcess;
  c->per_fast = static_cast<float>(1 / Hull::kSpeedReach);
  c->slip_min = static_cast<float>(box.slip_min);
  c->slip_max = static_cast<float>(box.slip_max);
  c->most_lateral = box.attack_angle_max_rad < std::numbers::pi / 2
                        ? static_cast<float>(std::sin(box.attack_angle_max_rad))
                        : 1.0f;
  c->log_low = static_cast<float>(std::log(box.load_min_n));
  c->log_high = static_cast<float>(std::log(box.load_max_n));
  c->per_slip = static_cast<float>(1 / Hull::kSlipReach);
  c->per_lateral = static_cast<float>(1 / Hull::kLateralReach);
  c->per_log_load = static_cast<float>(1 / Hull::kLogLoadReach);
  c->far = static_cast<float>(Hull::kFarFromRuns);
  c->overload = static_cast<float>(Hull::kOverloadSinkage);
}

void DescribeUncertainty(const Hull& hull, response::Constants* c) {
  const Uncertainty& u = hull.uncertainty();
  c->inverse_middle_load = 1 / hull.middle_load();
  for (int o = 0; o < kOutputs; ++o) {
    c->inside2[o] = static_cast<float>(u.fit_inside[o] * u.fit_inside[o]);
    c->growth2[o] = static_cast<float>(u.fit_growth[o] * u.fit_growth[o]);
    c->patch[o] = static_cast<float>(u.patch[o]);
    c->patch2[o] = static_cast<float>(u.patch[o] * u.patch[o]);
    c->factor[o] = static_cast<float>(u.interval_factor[o]);
    c->bulldozing[o] = static_cast<float>(u.bulldozing[o]);
  }
  c->flags = u.Flags();
}

}  // namespace

ResponseTable::ResponseTable(const TableAxes& axes,
                             const std::array<std::span<const double>, kChannels>& coefficients,
                             std::span<const double> margin)
    : axes_(axes) {
  static_assert(kChannels == response::kMarginChannel);
  CheckCoefficients(axes, coefficients);
  nodes_.resize(PairsOf(axes));  // zeros
  for (int channel = 0; channel < kChannels; ++channel) {
    Fill(channel, coefficients[channel], &nodes_);
  }
  constexpr double kAmple = 8;
  const std::vector<double> ample(margin.empty() ? ResidualTable::Size(axes) : 0, kAmple);
  Fill(response::kMarginChannel, margin.empty() ? ample : margin, &nodes_);
}

std::size_t ResponseTable::PairsOf(const TableAxes& axes) noexcept {
  return static_cast<std::size_t>(axes.direction + 3) * (axes.lateral + 3) * RowPairs(axes);
}

std::size_t ResponseTable::SizeOf(const TableAxes& axes, const SpeedAxis& speed) noexcept {
  return PairsOf(axes) * sizeof(NodePair) * (speed.present() ? 2 : 1);
}

ResponseTable::ResponseTable(const TableAxes& axes, const SpeedAxis& speed, std::string_view bytes)
    : axes_(axes), speed_(speed) {
  if (bytes.size() != SizeOf(axes, speed)) {
    throw std::invalid_argument("response table: " + std::to_string(bytes.size()) +
                                " bytes, expected " + std::to_string(SizeOf(axes, speed)));
  }
  const auto take = [&](std::vector<NodePair>* nodes) {
    nodes->resize(PairsOf(axes));
    const std::size_t size = nodes->size() * sizeof(NodePair);
    std::memcpy(nodes->data(), bytes.data(), size);
    bytes.remove_prefix(size);
  };
  take(&nodes_);
  if (speed.present()) take(&rate_);
}

std::string ResponseTable::Bytes() const {
  std::string bytes;
  bytes.reserve(SizeOf(axes_, speed_));
  for (const std::vector<NodePair>* nodes : {&nodes_, &rate_}) {
    bytes.append(reinterpret_cast<const char*>(nodes->data()), nodes->size() * sizeof(NodePair));
  }
  return bytes;
}

void ResponseTable::AddSpeed(const SpeedAxis& speed,
                             const std::array<std::span<const double>, kChannels>& coefficients) {
  CheckSpeedAxis(speed, axes_, axes_);
  CheckCoefficients(axes_, coefficients);
  if (!coefficients[ResidualTable::kDistance].empty()) {
    throw std::invalid_argument("speed axis: a hull distance, expected none");
  }
  speed_ = speed;
  rate_.resize(nodes_.size());
  for (int channel = 0; channel < kChannels; ++channel) {
    Fill(channel, coefficients[channel], &rate_);
  }
}

void ResponseTable::Fill(int channel, std::span<const double> values,
                         std::vector<NodePair>* nodes) const {
  if (values.empty()) return;
  const int lines = (axes_.direction + 3) * (axes_.lateral + 3), row = axes_.load + 3;
  for (int line = 0; line < lines; ++line) {
    for (int k = 0; k < row; ++k) {
      (*nodes)[static_cast<std::size_t>(line) * RowPairs(axes_) + k / 2]
          .lane[k % 2 * response::kGroup + channel] =
          static_cast<float>(values[static_cast<std::size_t>(line) * row + k]);
    }
  }
}

response::Constants ResponseTable::Describe(const Hull& hull, double radius_m) const {
  response::Constants c{};
  c.nodes = nodes_.data()->lane;
  c.lateral_stride = RowPairs(axes_) * 2 * response::kGroup;
  c.direction_stride = (axes_.lateral + 3) * c.lateral_stride;
  c.direction = axes_.direction;
  c.lateral = axes_.lateral;
  c.load = axes_.load;
  c.log_load_min = static_cast<float>(axes_.log_load_min);
  c.load_per_log = static_cast<float>(axes_.load / (axes_.log_load_max - axes_.log_load_min));
  // What single precision holds with room to spare.
  c.lowest_load = c.blend_low = 1e-30;
  c.highest_load = c.blend_high = 1e30;
  c.radius = radius_m;
  if (speed_.present()) {
    c.rate = rate_.data()->lane;
    c.froude_per_speed2 = hull.Froude(1, radius_m);
    c.froude_high = speed_.high;
    c.saturation = speed_.saturation;
    c.scale_reference = speed_.Scale(speed_.reference);
  }
  DescribeHull(hull, radius_m, &c);
  DescribeUncertainty(hull, &c);
  return c;
}

}  // namespace grouser::surrogate
