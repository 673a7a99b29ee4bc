#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "surrogate/models/hull.h"
#include "surrogate/models/residual_table.h"
#include "surrogate/models/response_kernel.h"

namespace grouser::surrogate {

/// Tensor product of uniform cubic B-splines like ResidualTable's, of the whole
/// answer, laid out for the kernels: single precision, all channels of a node
/// side by side in 32 bytes, so that one load fetches them; nodes along the
/// load next to one another. Rounding: 1e-6 of the load, load x radius or
/// radius. Channels and parity: see ResidualTable.
class ResponseTable {
 public:
  static constexpr int kChannels = ResidualTable::kChannels;

  /// Coefficients as ResidualTable takes them, and the same refusals. margin: the
  /// same of ln(largest load that has an equilibrium/load); empty: everywhere ample.
  ResponseTable(const TableAxes& axes,
                const std::array<std::span<const double>, kChannels>& coefficients,
                std::span<const double> margin = {});

  /// A table with the numbers of another one of these axes, as its Bytes() gave them. Throws
  /// std::invalid_argument on another count than SizeOf; what the bytes say is not checked.
  ResponseTable(const TableAxes& axes, const SpeedAxis& speed, std::string_view bytes);
  std::string Bytes() const;
  static std::size_t SizeOf(const TableAxes& axes, const SpeedAxis& speed) noexcept;

  /// A second table on the same axes: the answer is T + u T_rate, u by SpeedAxis::At.
  /// The hull distance's channel must be none. Refuses as the constructor does.
  void AddSpeed(const SpeedAxis& speed,
                const std::array<std::span<const double>, kChannels>& coefficients);

  const TableAxes& axes() const { return axes_; }

  /// The table, and the laws of `hull`, as a kernel reads them; valid as long
  /// as this table. Loads outside [lowest, highest] N are not answered, those
  /// outside [blend_low, blend_high] marked.
  response::Constants Describe(const Hull& hull, double radius_m) const;

 private:
  struct alignas(64) NodePair {
    float lane[2 * response::kGroup];
  };
  static int RowPairs(const TableAxes& axes) { return (axes.load + 4) / 2; }  // load + 3 nodes
  static std::size_t PairsOf(const TableAxes& axes) noexcept;
  void Fill(int channel, std::span<const double> values, std::vector<NodePair>* nodes) const;

  TableAxes axes_;
  std::vector<NodePair> nodes_, rate_;
  SpeedAxis speed_;
};

}  // namespace grouser::surrogate
