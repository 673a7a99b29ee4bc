#pragma once

#include <array>
#include <span>
#include <vector>

#include "surrogate/models/kinematics.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// Uniform nodes of the table, in intervals along each axis.
/// direction [-pi/2, pi/2] and lateral [0, pi/2]: see ToChart;
/// log_load: ln(load / 1 N).
struct TableAxes {
  bool operator==(const TableAxes&) const = default;

  int direction = 0, lateral = 0, load = 0;  ///< intervals, each at least 1
  double log_load_min = 0, log_load_max = 0;
};

/// Tensor product of uniform cubic B-splines (twice continuously
/// differentiable) of the canonical state: T(x) = sum c_ijk B_i B_j B_k.
///
/// Why not over slip and attack angle: those are singular where hub and rim
/// motion vanish together and double-valued under counter-rotation; this chart
/// is regular everywhere but at the state STATIC. Mirror symmetry stands in the
/// coefficients (Parity): direction wraps with period pi, where a state meets
/// its mirror in x; lateral starts at 0, where it meets its mirror in y.
///
/// Channels: the six outputs, then the hull distance (0 at training runs, 1
/// far away). Forces are per load, moments per load and radius, sinkage per
/// radius. f_z is the load and needs none: its channel is the share of the table
/// in the answer, beside which 1 less it is the physics' (kShare).
class ResidualTable {
 public:
  static constexpr int kChannels = kOutputs + 1;
  static constexpr int kDistance = kOutputs;
  static constexpr int kShare = kFz;

  /// No table: all channels 0.
  ResidualTable() = default;
  /// coefficients[channel]: (direction + 3)(lateral + 3)(load + 3) numbers,
  /// row-major, or none for 0. Throws std::invalid_argument on other sizes,
  /// non-finite numbers or bad axes.
  ResidualTable(const TableAxes& axes,
                const std::array<std::span<const double>, kChannels>& coefficients);

  /// All channels at a state; the load is clamped to the axis.
  std::array<double, kChannels> Evaluate(const ChartPoint& at, double log_load) const noexcept;

  /// One channel, of its coefficients where they stand (none: 0): no table is made for a single
  /// state. Bit by bit what Evaluate says. Throws as the constructor on other sizes and bad axes.
  static double EvaluateChannel(const TableAxes& axes, std::span<const double> coefficients,
                                const ChartPoint& at, double log_load);

  bool empty() const { return coefficients_.empty(); }
  /// Whether an output's coefficient is other than 0.
  bool has_outputs() const { return has_outputs_; }
  /// Whether the table has a share in the answer rather than being added to it.
  bool has_share() const { return has_share_; }
  const TableAxes& axes() const { return axes_; }

  /// Sign under the mirrors of a channel: x (v_x and rim), y (v_y).
  struct Parity {
    int x, y;
  };
  static Parity ParityOf(int channel) noexcept;
  /// Number of padded coefficients of one channel.
  static std::size_t Size(const TableAxes& axes) noexcept;

 private:
  static constexpr int kLanes = 8;  // channels, padded for vector loads
  TableAxes axes_;
  std::vector<double> coefficients_;
  bool has_outputs_ = false, has_share_ = false;
};

struct SpeedAxis;
/// Throws std::invalid_argument "speed axis: ..." unless it is present, finite, and
/// its table stands on the axes of the other.
void CheckSpeedAxis(const SpeedAxis& speed, const TableAxes& table, const TableAxes& rate);

/// Throws std::invalid_argument where the constructor above does.
void CheckCoefficients(
    const TableAxes& axes,
    const std::array<std::span<const double>, ResidualTable::kChannels>& coefficients);

}  // namespace grouser::surrogate
