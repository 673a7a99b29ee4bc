#include "surrogate/models/residual_table.h"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "surrogate/models/hull.h"

namespace grouser::surrogate {
namespace {

struct Weights {
  int first;
  std::array<double, 4> w;
};

// Uniform cubic B-spline weights at t in [0, n]; `first` counts padded
// coefficients, of which the first belongs to node -1.
Weights CubicWeights(double t, int n) {
  const double bounded = t > 0 ? (t < n ? t : n) : 0;
  int cell = static_cast<int>(bounded);
  if (cell > n - 1) cell = n - 1;
  const double f = bounded - cell, g = 1 - f;
  return {
      cell,
      {g * g * g / 6, (4 + 3 * f * f * (f - 2)) / 6, (4 + 3 * g * g * (g - 2)) / 6, f * f * f / 6}};
}

/// Calls add(index, weight) for the 64 coefficients that have a share in the answer.
template <class Add>
void AddUp(const TableAxes& axes, const ChartPoint& at, double log_load, const Add& add) {
  constexpr double kPi = std::numbers::pi;
  const Weights a =
      CubicWeights((at.direction_rad + kPi / 2) / kPi * axes.direction, axes.direction);
  const Weights b = CubicWeights(at.lateral_rad / (kPi / 2) * axes.lateral, axes.lateral);
  const Weights c = CubicWeights(
      (log_load - axes.log_load_min) / (axes.log_load_max - axes.log_load_min) * axes.load,
      axes.load);
  const std::size_t row = axes.load + 3, plane = (axes.lateral + 3) * row;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      const double wij = a.w[i] * b.w[j];
      const std::size_t first = (a.first + i) * plane + (b.first + j) * row + c.first;
      for (int k = 0; k < 4; ++k) add(first + k, wij * c.w[k]);
    }
  }
}

void CheckAxes(const TableAxes& axes) {
  for (const int n : {axes.direction, axes.lateral, axes.load}) {
    if (n < 1 || n > 10000) {
      throw std::invalid_argument("residual table: " + std::to_string(n) +
                                  " intervals on an axis, expected 1 to 10000");
    }
  }
  if (!std::isfinite(axes.log_load_min) || !std::isfinite(axes.log_load_max) ||
      !(axes.log_load_max > axes.log_load_min)) {
    throw std::invalid_argument("residual table: log_load_knots: expected finite and ascending");
  }
}

}  // namespace

std::size_t ResidualTable::Size(const TableAxes& axes) noexcept {
  return static_cast<std::size_t>(axes.direction + 3) * (axes.lateral + 3) * (axes.load + 3);
}

ResidualTable::Parity ResidualTable::ParityOf(int channel) noexcept {
  if (channel >= kOutputs) return {1, 1};  // the hull distance
  return {kOutputFields[channel].parity_x, kOutputFields[channel].parity_y};
}

void CheckCoefficients(
    const TableAxes& axes,
    const std::array<std::span<const double>, ResidualTable::kChannels>& coefficients) {
  CheckAxes(axes);
  const std::size_t size = ResidualTable::Size(axes);
  for (int channel = 0; channel < ResidualTable::kChannels; ++channel) {
    const std::span<const double> source = coefficients[channel];
    const std::string name = "residual table: coefficients[" + std::to_string(channel) + "]";
    if (source.empty()) continue;
    if (source.size() != size) {
      throw std::invalid_argument(name + ": " + std::to_string(source.size()) +
                                  " numbers, expected " + std::to_string(size));
    }
    for (std::size_t i = 0; i < size; ++i) {
      if (std::isfinite(source[i])) continue;
      throw std::invalid_argument(name + "[" + std::to_string(i) + "]: expected a finite number");
    }
  }
}

void CheckSpeedAxis(const SpeedAxis& speed, const TableAxes& table, const TableAxes& rate) {
  if (!(speed.saturation >= 0) || !std::isfinite(speed.saturation)) {
    throw std::invalid_argument("speed axis: froude_saturation: expected 0 or more");
  }
  if (!(speed.high > 0) || !std::isfinite(speed.high) || !(speed.reference >= 0) ||
      !(speed.reference <= speed.high)) {
    throw std::invalid_argument(
        "speed axis: froude_reference and froude_max: expected 0 <= reference <= max, max > 0");
  }
  if (!(table == rate)) {
    throw std::invalid_argument("speed axis: its table has other axes than the answer's");
  }
}

ResidualTable::ResidualTable(const TableAxes& axes,
                             const std::array<std::span<const double>, kChannels>& coefficients)
    : axes_(axes) {
  CheckCoefficients(axes, coefficients);
  const std::size_t size = Size(axes);
  coefficients_.assign(size * kLanes, 0.0);
  for (int channel = 0; channel < kChannels; ++channel) {
    if (coefficients[channel].empty()) continue;
    for (std::size_t i = 0; i < size; ++i) {
      coefficients_[i * kLanes + channel] = coefficients[channel][i];
      has_outputs_ |= channel < kOutputs && coefficients[channel][i] != 0;
      has_share_ |= channel == kShare && coefficients[channel][i] != 0;
    }
  }
}

std::array<double, ResidualTable::kChannels> ResidualTable::Evaluate(
    const ChartPoint& at, double log_load) const noexcept {
  std::array<double, kChannels> result{};
  if (empty()) return result;
  double sum[kLanes] = {};
  AddUp(axes_, at, log_load, [&](std::size_t i, double w) {
    const double* p = &coefficients_[i * kLanes];
    for (int lane = 0; lane < kLanes; ++lane) sum[lane] += w * p[lane];
  });
  for (int channel = 0; channel < kChannels; ++channel) result[channel] = sum[channel];
  return result;
}

double ResidualTable::EvaluateChannel(const TableAxes& axes, std::span<const double> coefficients,
                                      const ChartPoint& at, double log_load) {
  CheckAxes(axes);
  if (coefficients.empty()) return 0;
  if (coefficients.size() != Size(axes)) {
    throw std::invalid_argument("residual table: " + std::to_string(coefficients.size()) +
                                " coefficients, expected " + std::to_string(Size(axes)));
  }
  double sum = 0;
  AddUp(axes, at, log_load, [&](std::size_t i, double w) { sum += w * coefficients[i]; });
  return sum;
}

}  // namespace grouser::surrogate
