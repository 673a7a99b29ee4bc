#include "surrogate/models/response_table.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace grouser::surrogate {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

void DescribeHull(const Hull& hull, double radius_m, response::Constants* c) {
  const HullBox& box = hull.box();
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
  c->fastest2 = box.froude_max > 0 ? box.froude_max * box.gravity_m_per_s2 * radius_m : kNever;

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
  }
  c->flags = u.form_unknown ? kFormUnknown : 0u;
}

}  // namespace

ResponseTable::ResponseTable(const TableAxes& axes,
                             const std::array<std::span<const double>, kChannels>& coefficients,
                             std::span<const double> margin)
    : axes_(axes) {
  static_assert(response::kOutputCount == kOutputs && kChannels == response::kMarginChannel);
  CheckCoefficients(axes, coefficients);
  const int lines = (axes.direction + 3) * (axes.lateral + 3), row = axes.load + 3;
  nodes_.resize(static_cast<std::size_t>(lines) * RowPairs());  // zeros
  const auto fill = [&](int channel, const auto& value) {
    for (int line = 0; line < lines; ++line) {
      for (int k = 0; k < row; ++k) {
        nodes_[static_cast<std::size_t>(line) * RowPairs() + k / 2]
            .lane[k % 2 * response::kGroup + channel] =
            static_cast<float>(value(static_cast<std::size_t>(line) * row + k));
      }
    }
  };
  for (int channel = 0; channel < kChannels; ++channel) {
    const std::span<const double> from = coefficients[channel];
    if (!from.empty()) fill(channel, [&](std::size_t i) { return from[i]; });
  }
  constexpr double kAmple = 8;
  fill(response::kMarginChannel,
       [&](std::size_t i) { return margin.empty() ? kAmple : margin[i]; });
}

response::Constants ResponseTable::Describe(const Hull& hull, double radius_m) const {
  response::Constants c{};
  c.nodes = nodes_.data()->lane;
  c.lateral_stride = RowPairs() * 2 * response::kGroup;
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
  DescribeHull(hull, radius_m, &c);
  DescribeUncertainty(hull, &c);
  return c;
}

}  // namespace grouser::surrogate
