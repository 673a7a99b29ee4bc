#pragma once

#include <array>

#include "surrogate/models/bekker.h"
#include "surrogate/models/residual_table.h"
#include "surrogate/models/wheel_model.h"

namespace grouser::surrogate {

/// What the training runs covered. Mirrored in v_x and v_y.
struct HullBox {
  double slip_min = -1, slip_max = 1;   ///< [-]
  double attack_angle_max_rad = 0;
  double load_min_n = 0, load_max_n = 0;
  double froude_max = 0;                ///< v^2/(g r) above which kRate is set; 0: never
  double gravity_m_per_s2 = 9.81;
};

/// Uncertainty per output, at the middle load sqrt(load_min load_max).
struct Uncertainty {
  std::array<double, kOutputs> fit_inside{}, fit_growth{}, patch{};
  std::array<double, kOutputs> interval_factor{};
  bool form_unknown = true;  ///< sd_form of some output is NaN
};

/// Physics trend + table of the residual (DESIGN: "hybrid"); with a table of
/// hull distances alone it is the bekker rung.
///
///   value    = bekker(state) + s T(state), s = load, load r or r
///   sd_fit   = hypot(fit_inside, fit_growth D), D the hull distance
///   interval = value +- factor hypot(sd_fit, sd_patch): a fresh DEM run's mean
///
/// Deviations of forces and moments are taken proportional to the load.
///
/// Flags: kInvalid non-finite input, load <= 0 (NaN out); kStatic V = r w = 0
/// (static sinkage, no force but f_z); kExtrapolated outside the hull box, or a
/// sinkage beyond 0.7 r, where no steady run exists; kNoEquilibrium with
/// kClamped where 1.2 r of sinkage does not carry the load; kClamped also for a
/// negative sinkage and for a yaw rate, which is taken as 0; kRate, kSlope,
/// kVirginAssumed, kFormUnknown.
class HybridModel final : public WheelModel {
 public:
  HybridModel(const BekkerModel& physics, ResidualTable table, const HullBox& hull,
              const Uncertainty& uncertainty);

  void Evaluate(const WheelStatesView& in, const ResponsesView& out) const noexcept override;

  /// One state, for the fitter and for tests. Same preconditions as
  /// BekkerModel::Solve, or V = r w = 0.
  struct Answer {
    std::array<double, kOutputs> value, sd_fit, sd_patch, half_width;
    std::uint32_t flags;
  };
  Answer EvaluateOne(double v_x, double v_y, double rim_speed, double load) const noexcept;

  const BekkerModel& physics() const { return physics_; }
  const HullBox& hull() const { return hull_; }

 private:
  bool OutsideBox(const Canonical& state, double load) const noexcept;
  /// How far a state is beyond the box, in units of hull distance: 0 inside,
  /// continuous, growing without bound, so that intervals do too.
  double Excess(const Canonical& state, double load) const noexcept;
  void AddUncertainty(double distance, double load, Answer* answer) const noexcept;

  BekkerModel physics_;
  ResidualTable table_;
  HullBox hull_;
  Uncertainty uncertainty_;
  double middle_load_;
};

}  // namespace grouser::surrogate
