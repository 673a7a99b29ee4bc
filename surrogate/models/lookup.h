#pragma once

#include <array>
#include <span>

#include "surrogate/models/bekker.h"
#include "surrogate/models/tabulated_model.h"

namespace grouser::surrogate {

/// A table of the whole answer, without physics beneath it.
///
///   value = s (T(state) + u T_rate(state)), s = load, load r or r
///
/// channels as ResidualTable's; u by SpeedAxis::At, 0 without a speed axis.
///
/// Beyond its load axis T keeps the values of the axis' end, flagged
/// kExtrapolated with intervals that grow (Hull::Excess). A wheel at rest
/// (kStatic) gets the sinkage of a freely rolling one, f_z = load and no other
/// force. Flags otherwise as HybridModel's, but never kNoEquilibrium.
class LookupModel final : public TabulatedModel {
 public:
  /// coefficients: see ResidualTable. Throws std::invalid_argument as
  /// ResponseTable and Hull do, or for a radius that is not positive.
  LookupModel(const TableAxes& axes,
              const std::array<std::span<const double>, ResponseTable::kChannels>& coefficients,
              const TrainingDomain& box, const Uncertainty& uncertainty, const WheelGeometry& wheel,
              const SpeedAxis& speed = {},
              const std::array<std::span<const double>, ResponseTable::kChannels>& rate = {});

 protected:
  WheelAnswer OffTable(double v_x, double v_y, double rim_speed,
                       double load) const noexcept override;

 private:
  WheelGeometry wheel_;
};

}  // namespace grouser::surrogate
